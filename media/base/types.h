#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace nullmark {

/// Scalar of positions, extinctions and weights.
using Real = double;

/// Point or direction; lengths in world units unless a frame is named.
using Vec3 = Eigen::Matrix<Real, 3, 1>;

/// Affine map between the world and a medium's local frame.  Like Spectrum without alignment demands, so that the layout does not
/// depend on the instruction set a translation unit was compiled for.
using Affine = Eigen::Transform<Real, 3, Eigen::AffineCompact, Eigen::DontAlign>;

inline constexpr int kMaxChannels = 16;
inline constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// One number per channel, of a width known to the compiler.
template <int width>
using SpectrumOf = Eigen::Array < Real,
      width, 1, Eigen::ColMajor | Eigen::DontAlign, width<0 ? kMaxChannels : width, 1>;

/// One number per channel: a run-time count within a fixed capacity, so that it never allocates.
using Spectrum = SpectrumOf<Eigen::Dynamic>;

/// Axis-aligned box, lo <= hi in every component.
struct Box {
  Vec3 lo = Vec3::Zero();
  Vec3 hi = Vec3::Ones();

  Vec3 extent() const { return hi - lo; }
  bool empty() const { return !(lo.array() < hi.array()).all(); }
};

/// The points origin + t direction, begin <= t <= end.  In the world frame the direction is a unit vector, so t is a world
/// length; in a local frame the same t is kept and the direction is the mapped one.
struct Ray {
  Vec3 origin = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  Real begin = 0;
  Real end = kInfinity;

  Vec3 at(Real t) const { return origin + t * direction; }
  Real length() const { return end > begin ? end - begin : 0; }
};

/// The ray in another frame; t keeps its meaning because the map is affine.
inline Ray transformed(const Ray& ray, const Affine& map) {
  return {map * ray.origin, map.linear() * ray.direction, ray.begin, ray.end};
}

/// Distances along a ray.
struct RayPart {
  Real begin, end;
};

/// The part of [ray.begin, ray.end] inside the box; empty (begin == end) where the ray misses.  Axis-parallel rays (components
/// +-0) are inside a slab or miss it; no 0 * infinity can arise.
inline RayPart part_inside(const Box& box, const Ray& ray) {
  Real begin = ray.begin, end = ray.end;
  for (int axis = 0; axis < 3; ++axis) {
    const Real o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0) {
      if (o < box.lo[axis] || o > box.hi[axis]) end = -kInfinity;
      continue;
    }
    const Real a = (box.lo[axis] - o) / d, b = (box.hi[axis] - o) / d;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(begin < end)) begin = end = std::isfinite(begin) ? begin : 0;
  return {begin, end};
}

/// Cuts a ray to the part inside the box.
inline Ray clipped(Ray ray, const Box& box) {
  const RayPart part = part_inside(box, ray);
  ray.begin = part.begin;
  ray.end = part.end;
  return ray;
}

}  // namespace nullmark
