#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "media/base/parameters.h"
#include "media/base/types.h"

namespace nullmark {

/// n points in a medium's local frame, coordinate by coordinate.
template <class T>
struct BasicPoints {
  const T* x = nullptr;
  const T* y = nullptr;
  const T* z = nullptr;
  std::size_t size = 0;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};
using Points = BasicPoints<Real>;
using SinglePoints = BasicPoints<float>;

/// Extinction over a box, per channel, in 1/length.  minimum <= mu <= maximum holds at every point of the box (true bounds, not
/// estimates); the average may be approximate, since it serves as a control only.
struct Extrema {
  Spectrum minimum, average, maximum;

  static Extrema grey(Real minimum, Real average, Real maximum) {
    return {Spectrum::Constant(1, minimum), Spectrum::Constant(1, average), Spectrum::Constant(1, maximum)};
  }
};

/// An extrema's number of a grey field in all channels.  An unbounded number times a factor 0 is 0, not NaN.
inline Spectrum scaled(const Spectrum& factors, Real grey) {
  return (factors == 0).select(Spectrum::Zero(factors.size()), factors * grey);
}

/// A field of extinction mu >= 0 in 1/length (world), with what bounds it.  Zero outside `bounds()`.  Everything is told in a
/// local frame (unit cube, box, voxel indices), reached from the world by `world_to_local()`; distances t along rays stay world
/// lengths. Immutable after construction, so one instance serves all threads.
class Medium {
 public:
  virtual ~Medium() = default;

  /// 1 to kMaxChannels.
  virtual int channels() const { return 1; }

  /// Local box outside which the extinction is zero.
  virtual Box bounds() const = 0;

  virtual Affine world_to_local() const { return Affine::Identity(); }

  /// One lookup per point: out[i * channels() + c] = mu_c(points[i]).  Points lie inside `bounds()` up to rounding.
  virtual void extinction(const Points& points, Real* out) const = 0;

  /// The same in single precision, of grey media: by way of double where a medium has nothing better.
  virtual void extinction(const SinglePoints& points, float* out) const;

  /// Bounds and average over a local box (cut to `bounds()`; the vacuum outside is not counted).
  virtual Extrema extrema(const Box& box) const = 0;

  /// Where mu_c(p) = factors[c] grey(p): the grey field and the factors.
  struct ScaledField {
    const Medium* grey;
    Spectrum factors;
  };
  virtual std::optional<ScaledField> scaled() const { return std::nullopt; }

  /// Whether the local frame counts voxels that are stored in nodes of 8^3, aligned to multiples of 8.
  virtual bool has_nodes() const { return false; }

  /// Appends distances t in (ray.begin, ray.end), in any order, at which the extinction along the local ray or one of its
  /// derivatives jumps, and enough of them that between neighbours it is resolved by a 15-point rule.
  virtual void knots(const Ray& /*ray*/, std::vector<Real>& /*t*/) const {}

  /// Degree of the polynomial in t that the extinction follows between neighbouring knots, where it is one: exact traversal
  /// (regular tracking) integrates it with degree/2 + 1 Gauss points.
  virtual std::optional<int> polynomial_degree() const { return std::nullopt; }

  /// Digest of data that the parameters do not tell, such as the voxels of a file; 0 where there are none.
  virtual std::uint64_t content_hash() const { return 0; }

  /// Optical depth of the local ray over [begin, end] in closed form, per channel; nothing where there is none.
  virtual std::optional<Spectrum> optical_depth(const Ray& /*ray*/) const { return std::nullopt; }

  /// Its inverse on a grey medium: the distance t at which the depth from begin is `depth`, infinite where the ray is not that
  /// deep; nothing where there is no closed form.
  virtual std::optional<Real> distance_at_depth(const Ray& /*ray*/, Real /*depth*/) const { return std::nullopt; }

  /// Of a grey medium that is a sum: the number of its components (at most kMaxChannels), their bounds over a local box, and one
  /// alone at a point.  Others are their only component.
  virtual int components() const { return 1; }
  virtual Spectrum component_maxima(const Box& box) const { return extrema(box).maximum; }
  virtual Real component_extinction(int /*component*/, const Vec3& point) const {
    Real out = 0;
    extinction({&point.x(), &point.y(), &point.z(), 1}, &out);
    return out;
  }
};

inline void Medium::extinction(const SinglePoints& points, float* out) const {
  constexpr std::size_t kBlock = 256;
  Real x[kBlock], y[kBlock], z[kBlock], extinction[kBlock];
  for (std::size_t done = 0; done < points.size; done += kBlock) {
    const std::size_t n = std::min(kBlock, points.size - done);
    std::copy_n(points.x + done, n, x);
    std::copy_n(points.y + done, n, y);
    std::copy_n(points.z + done, n, z);
    this->extinction(Points{x, y, z, n}, extinction);
    for (std::size_t i = 0; i < n; ++i) out[done + i] = static_cast<float>(extinction[i]);
  }
}

}  // namespace nullmark
