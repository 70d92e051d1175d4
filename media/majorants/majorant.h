#pragma once

#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "media/base/medium.h"

namespace nullmark {

/// What a flight does at the end of a cell.  carry: what is left of its exponential goes on in the next cell; rewind: it is cut
/// there and drawn anew in the next cell that has a rate [Yue et al. 2010, Sec. 3].  The exponential has no memory, so collisions
/// follow the same law; rewinding costs one more random number per cell left.
enum class Crossing { carry, rewind };

/// One stretch of a ray with bounds on the extinction inside it.
struct Segment {
  Real begin = 0;  ///< distance along the ray, length
  Real end = 0;
  Real majorant = 0;   ///< rate of tentative collisions, 1/length: the largest channel's bound times the looseness
  Extrema extinction;  ///< per channel, without the looseness
  Real diagonal = 0;   ///< of the structure's cell, world length (for the gamma rule of residual tracking)
};

/// Extinction above its bound by less, relatively, is rounding of either, where lookups are numbers of type T.
template <class T>
inline constexpr Real kBoundRounding = std::is_same_v<T, Real> ? 1e-9 : 1e-6;

/// Whether an extinction is above its bound, beyond the rounding of either.
inline bool exceeds(Real extinction, Real bound) { return extinction > bound * (1 + kBoundRounding<Real>); }

/// What a majorant structure makes of a ray: contiguous segments from ray.begin to ray.end.
struct SegmentBuffer {
  std::vector<Segment> segments;
  Crossing crossing = Crossing::carry;

  void clear() {
    segments.clear();
    crossing = Crossing::carry;
  }
};

/// How large a structure is.
struct StructureSize {
  std::uint64_t cells = 1;  ///< regions with bounds of their own
  std::uint64_t nodes = 0;  ///< of a tree, leaves included
  std::uint64_t bytes = 0;  ///< of memory

  bool operator==(const StructureSize&) const = default;
};

/// Bounds over a medium: data, not a template axis.  Built once per medium and shared by all estimators and threads.
class MajorantStructure {
 public:
  virtual ~MajorantStructure() = default;

  /// Fills the buffer with the segments of a ray, given in the world and in the medium's local frame (same t, already cut to the
  /// medium's bounds).  An empty interval gives no segment.
  virtual void segments(const Ray& world, const Ray& local, SegmentBuffer& out) const = 0;

  virtual StructureSize size() const = 0;
};

}  // namespace nullmark
