#pragma once

#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "media/base/types.h"

namespace nullmark {

/// The plane through `point`, seen from both sides; `normal` need not be a unit vector.
struct Plane {
  Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();
};

struct Sphere {
  Vec3 center = Vec3::Zero();
  Real radius = 1;
};

/// An opaque black surface, from outside and from inside: it absorbs all that meets it and emits the same radiance in every
/// direction.
struct Surface {
  std::variant<Plane, Box, Sphere> shape;
  Spectrum radiance;  ///< per channel; empty: 0
};

struct SurfaceHit {
  Real distance = kInfinity;         ///< along the ray, as its `begin` and `end`
  const Surface* surface = nullptr;  ///< null: nothing was hit
};

namespace detail {

/// Offsets smaller than this many times the rounding of what they were computed from count as zero: a ray that starts on a
/// surface does not meet it there.
inline constexpr Real kOnSurface = 16 * std::numeric_limits<Real>::epsilon();

/// Smallest t > 0 at which o + t d lies on the surface, |d| = 1; infinity where there is none.
inline Real first_crossing(const Plane& plane, const Vec3& o, const Vec3& d) {
  const Real height = plane.normal.dot(plane.point - o), slope = plane.normal.dot(d);
  const Real rounding = kOnSurface * plane.normal.cwiseAbs().dot(plane.point.cwiseAbs() + o.cwiseAbs());
  if (std::abs(height) <= rounding || slope == 0) return kInfinity;
  const Real t = height / slope;
  return t > 0 ? t : kInfinity;
}

inline Real first_crossing(const Box& box, const Vec3& o, const Vec3& d) {
  Real enter = -kInfinity, leave = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const auto offset = [&](Real face) {
      const Real by = face - o[axis];
      return std::abs(by) <= kOnSurface * (std::abs(face) + std::abs(o[axis])) ? 0 : by;
    };
    const Real low = offset(box.lo[axis]), high = offset(box.hi[axis]);
    if (d[axis] == 0) {
      if (low > 0 || high < 0) return kInfinity;
      continue;
    }
    enter = std::max(enter, std::min(low / d[axis], high / d[axis]));
    leave = std::min(leave, std::max(low / d[axis], high / d[axis]));
  }
  if (!(enter <= leave)) return kInfinity;
  return enter > 0 ? enter : leave > 0 ? leave : kInfinity;
}

inline Real first_crossing(const Sphere& sphere, const Vec3& o, const Vec3& d) {
  const Vec3 f = o - sphere.center;
  const Real along = f.dot(d);
  // The discriminant from the distance of the line to the centre: b^2 - c would cancel for spheres far away.
  const Real discriminant = sphere.radius * sphere.radius - (f - along * d).squaredNorm();
  if (!(discriminant > 0)) return kInfinity;
  Real power = f.squaredNorm() - sphere.radius * sphere.radius;
  const Real rounding = kOnSurface * (f.norm() + sphere.radius) * (o.cwiseAbs() + sphere.center.cwiseAbs()).sum();
  if (std::abs(power) <= rounding) power = 0;
  const Real root = -along - std::copysign(std::sqrt(discriminant), along);  // the root without cancellation
  const auto [near, far] = power == 0 ? std::pair<Real, Real>(0, -2 * along) : std::minmax<Real>({root, power / root});
  return near > 0 ? near : far > 0 ? far : kInfinity;
}

}  // namespace detail

/// The first surface met in (ray.begin, ray.end] of a world ray.  Surfaces that the ray starts on, up to rounding, are not met
/// there.
inline SurfaceHit first_hit(std::span<const Surface> surfaces, const Ray& ray) {
  SurfaceHit hit;
  const Vec3 start = ray.at(ray.begin);
  for (const Surface& surface : surfaces) {
    const Real t = ray.begin + std::visit([&](const auto& shape) { return detail::first_crossing(shape, start, ray.direction); },
                                          surface.shape);
    if (t <= ray.end && t < hit.distance) hit = {t, &surface};
  }
  return hit;
}

}  // namespace nullmark
