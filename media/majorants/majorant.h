#pragma once

#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "media/base/medium.h"
#include "media/majorants/rates.h"

namespace nullmark {

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

  /// The same segments, found as flights come to them; the structure outlives it.  Without an override all are listed at once.
  virtual std::unique_ptr<Traversal> traversal() const;

  virtual Crossing crossing() const { return Crossing::carry; }

  virtual StructureSize size() const = 0;
};

/// Lists a ray's segments and hands them out together.
class ListedTraversal final : public Traversal {
 public:
  explicit ListedTraversal(const MajorantStructure& structure) : structure_(structure) {}

  void start(const Ray& world, const Ray& local) override { structure_.segments(world, local, listed_); }

  bool extend(RatePieces& pieces, Real) override {
    for (const Segment& segment : listed_.segments) pieces.append(segment.end, segment.majorant);
    return false;
  }

 private:
  const MajorantStructure& structure_;
  SegmentBuffer listed_;
};

inline std::unique_ptr<Traversal> MajorantStructure::traversal() const { return std::make_unique<ListedTraversal>(*this); }

/// The cells of a structure along a ray.  Structure has
///
///   Walk                                  where a walk along a ray stands
///   void start(Walk&, world, local) const
///   bool walk(Walk&, visit) const         visit(end, cell) for the cells that follow, until it returns false (then true) or the
///                                         ray ends (then false)
///   Real rate(cell) const
template <class Structure>
class CellTraversal final : public Traversal {
 public:
  explicit CellTraversal(const Structure& structure) : structure_(structure) {}

  void start(const Ray& world, const Ray& local) override { structure_.start(walk_, world, local); }

  bool extend(RatePieces& pieces, Real depth) override {
    return structure_.walk(walk_, [&](Real end, std::size_t cell) {
      pieces.append(end, structure_.rate(cell));
      return !(depth < pieces.total_depth());
    });
  }

 private:
  const Structure& structure_;
  typename Structure::Walk walk_;
};

}  // namespace nullmark
