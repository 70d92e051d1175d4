#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <vector>

#include "media/base/lanes.h"
#include "media/volumes/sparse_table.h"

namespace nullmark {

/// Voxel indices.
using Index3 = Eigen::Vector3i;

/// Voxels lo <= index <= hi, both inclusive.
struct IndexBox {
  Index3 lo = Index3::Zero();
  Index3 hi = Index3::Zero();

  bool contains(const IndexBox& other) const {
    return (lo.array() <= other.lo.array()).all() && (hi.array() >= other.hi.array()).all();
  }

  /// Wider by n voxels on every side, as far as an int goes.
  IndexBox dilated(int n) const {
    const auto moved = [](int i, int by) {
      return static_cast<int>(std::clamp(std::int64_t{i} + by, std::int64_t{INT_MIN}, std::int64_t{INT_MAX}));
    };
    return {lo.unaryExpr([&](int i) { return moved(i, -n); }), hi.unaryExpr([&](int i) { return moved(i, n); })};
  }
};

/// What voxels of a range hold; the average is weighted.
struct RangeSummary {
  Real minimum = kInfinity;
  Real average = 0;
  Real maximum = -kInfinity;
};

/// Chains a word into a 64-bit hash (the finaliser of MurmurHash3, Appleby, public domain).
inline std::uint64_t hash_mixed(std::uint64_t hash, std::uint64_t word) {
  hash ^= word + 0x9e3779b97f4a7c15u;
  hash = (hash ^ (hash >> 33)) * 0xff51afd7ed558ccdu;
  hash = (hash ^ (hash >> 33)) * 0xc4ceb9fe1a85ec53u;
  return hash ^ (hash >> 33);
}

/// Sparse voxel values, answered without a tree walk: a dense table over the box, in bricks of 8^3 voxels aligned to multiples
/// of 8, tells each brick's values.  A brick stores 9^3 floats, its own voxels and one layer (the apron) of its upper
/// neighbours, so that the 8 taps of a trilinear lookup lie in one brick, at 9^3 / 8^3 = 1.42 times the memory.  Bricks of one
/// value share their storage, and the table costs memory only around what is not background.  Voxels outside the box hold the
/// background.  Voxel centres are at integer coordinates, as in OpenVDB.
class BrickGrid {
 public:
  static constexpr int kSide = 8;
  static constexpr int kStride = kSide + 1;
  static constexpr int kBrickValues = kStride * kStride * kStride;

  /// 4096^3 voxels of bounding box: half a gigabyte of table.
  static constexpr std::int64_t kMaxBricks = std::int64_t{1} << 27;
  static constexpr std::int64_t kMaxValueBytes = std::int64_t{16} << 30;
  /// Leaves room for the apron and for sums of indices in an int.
  static constexpr int kMaxIndex = 1 << 30;

  /// One background value everywhere.
  explicit BrickGrid(float background = 0) : background_(background) {}

  /// The one value of a brick, and the ones of its upper neighbours: brick + (x, y, z) at 4 x + 2 y + z.
  using Corners = std::array<float, 8>;

  /// What is not background, and nothing else costs more than a look at the table: `bricks(first, shape, visit)` calls
  /// visit(begin, end, corners) for stretches of the table - brick first + (i, j, k) has the place (i shape[1] + j) shape[2] + k
  /// - each brick at most once.  Where the bricks of a stretch of one row and their upper neighbours have but one value each, the
  /// same all along, `corners` tells them; else it is null and `fill(origin, values)` writes the voxels origin + (i, j, k), 0 <=
  /// i, j, k <= 8, to values[(i * 9 + j) * 9 + k].  `for_each(n, body)` calls body(0) ... body(n - 1), in any order or
  /// concurrently.  Throws std::length_error, before allocating, where the box or its values exceed the limits above.
  template <class Bricks, class Fill, class ForEach>
  static BrickGrid build(const IndexBox& box, float background, const Bricks& bricks, const Fill& fill, const ForEach& for_each);

  float background() const { return background_; }
  const IndexBox& box() const { return box_; }
  std::size_t bytes() const;

  /// 64-bit hash of box, background and all voxel values, whatever the sharing of bricks.
  std::uint64_t content_hash() const;

  float value(int i, int j, int k) const { return covers(i, j, k) ? *corner(i, j, k) : background_; }

  /// Value of the nearest voxel; halves round away from zero, as openvdb::tools::PointSampler does.
  float nearest(Real x, Real y, Real z) const {
    if (!covers(x, y, z)) return background_;
    return value(rounded(x), rounded(y), rounded(z));
  }

  /// Interpolation, in double precision, between the 8 voxels around a point.
  Real trilinear(Real x, Real y, Real z) const;

  /// The same for many points at once, in the precision of T: in double bit for bit the same.  Only where `fits_lanes()`.
  template <class T, std::size_t N>
  Lanes<T, N> trilinear(Lanes<T, N> x, Lanes<T, N> y, Lanes<T, N> z) const;

  /// Whether 32-bit indices reach all values.
  bool fits_lanes() const { return values_.size() <= std::size_t{INT_MAX}; }

  /// Extremes over a range, and the average sum w value / weight with w = weights(axis, index) multiplied over the axes,
  /// 0 <= w <= 1; `weight` is the sum of w over the whole range.
  template <class Weights>
  RangeSummary summary(const IndexBox& range, const Weights& weights, Real weight) const;

  /// Extremes and plain average over a range.
  RangeSummary summary(const IndexBox& range) const;

  /// The lexicographically first voxel of the box whose value satisfies the predicate.
  template <class Predicate>
  std::optional<Index3> find(const Predicate& predicate) const;

  static int floored(Real x) {
    const int i = static_cast<int>(x);
    return i - (x < i ? 1 : 0);
  }

  /// To the nearest integer, halves away from zero.  The largest double below 1/2 in place of 1/2 keeps the sum from rounding up.
  static int rounded(Real x) { return static_cast<int>(x + std::copysign(0.49999999999999994, x)); }

 private:
  // Of brick_grid_summary.h, which defines the first `summary`.
  struct Stretch;
  struct Stretches;
  struct RangeSums;
  template <class Weights>
  Stretches stretches(const IndexBox& range, const Weights& weights) const;

  struct BrickSummary {
    float minimum, maximum;
    Real sum;
  };

  /// What bricks that share their storage have in common: the bits of their corners, then the first and the last of their voxels
  /// that lie in the box, axis by axis, 0 to 8.
  using Pattern = std::array<std::uint32_t, 14>;

  static constexpr std::array<int, 3> kSteps{kStride * kStride, kStride, 1};

  BrickGrid(const IndexBox& box, float background);

  /// Also false for NaN.
  template <class Coordinate>
  bool covers(Coordinate x, Coordinate y, Coordinate z) const {
    return x >= table_lo_[0] && x < table_hi_[0] && y >= table_lo_[1] && y < table_hi_[1] && z >= table_lo_[2] &&
           z < table_hi_[2];
  }

  /// Values at voxel (i, j, k), with its upper neighbours kSteps further on.
  const float* corner(int i, int j, int k) const {
    const auto u = static_cast<unsigned>(i - table_lo_[0]), v = static_cast<unsigned>(j - table_lo_[1]),
               w = static_cast<unsigned>(k - table_lo_[2]);
    const std::size_t brick = table_[((u / kSide) * shape_[1] + v / kSide) * shape_[2] + w / kSide];
    return values_.data() + (brick * kBrickValues + ((u % kSide) * kStride + v % kSide) * kStride + w % kSide);
  }

  Index3 origin(std::size_t table_index) const;
  /// Of the table's first brick, in bricks.
  Index3 first() const { return Index3(table_lo_[0], table_lo_[1], table_lo_[2]) / kSide; }
  static Pattern uncut(const Corners& corners);
  Pattern cut(const Corners& corners, const Index3& origin) const;
  void clear_outside(const Index3& origin, float* values) const;
  void allocate(std::int64_t bricks);
  void store(std::size_t brick, const float* values);
  void store(std::size_t brick, const Pattern& pattern);

  float background_ = 0;
  IndexBox box_;
  // Whole bricks around the box, one voxel wider below, where the lowest voxels are upper taps; half open.
  std::array<int, 3> table_lo_{}, table_hi_{};
  std::array<std::size_t, 3> shape_{};
  SparseTable table_;  ///< 0: background
  std::vector<float> values_;
  std::vector<BrickSummary> summaries_;
};

inline Real BrickGrid::trilinear(Real x, Real y, Real z) const {
  if (!covers(x, y, z)) return background_;
  const int i = floored(x), j = floored(y), k = floored(z);
  const float* const v = corner(i, j, k);
  const Real fx = x - i, fy = y - j, fz = z - k;
  const auto mix = [](Real a, Real b, Real f) { return a + (b - a) * f; };
  const auto edge = [&](const float* at) { return mix(at[0], at[1], fz); };
  const auto face = [&](const float* at) { return mix(edge(at), edge(at + kSteps[1]), fy); };
  return mix(face(v), face(v + kSteps[0]), fx);
}

template <class T, std::size_t N>
Lanes<T, N> BrickGrid::trilinear(Lanes<T, N> x, Lanes<T, N> y, Lanes<T, N> z) const {
  using Pack = Lanes<T, N>;
  if (table_.empty()) return Pack(background_);
  const hn::FixedTag<std::int32_t, N> integers;
  const hn::FixedTag<float, N> singles;
  const auto covered = [&](Pack at, std::size_t axis) { return (!(at < Pack(table_lo_[axis]))) & (at < Pack(table_hi_[axis])); };
  const LaneMask<T, N> inside = covered(x, 0) & covered(y, 1) & covered(z, 2);
  // Points outside look up the table's first voxel, in vain.
  const auto index = [&](Pack& at, std::size_t axis) {
    const Pack floor = rounded_down(at);
    at = at - floor;
    const Pack from_corner = select(inside, floor - Pack(table_lo_[axis]), Pack(0));
    if constexpr (sizeof(T) == sizeof(float))
      return hn::ConvertTo(integers, from_corner.vector());
    else
      return hn::DemoteTo(integers, from_corner.vector());
  };
  const auto number = [&](std::size_t n) { return hn::Set(integers, static_cast<std::int32_t>(n)); };
  const auto u = index(x, 0), v = index(y, 1), w = index(z, 2);
  const auto of_brick = [&](auto i) { return hn::ShiftRight<3>(i); };
  const auto in_brick = [&](auto i) { return hn::And(i, number(kSide - 1)); };
  const auto row = hn::Add(hn::Mul(of_brick(u), number(shape_[1])), of_brick(v));
  const auto cell = hn::Add(hn::Mul(row, number(shape_[2])), of_brick(w));
  const auto brick = hn::GatherIndex(integers, reinterpret_cast<const std::int32_t*>(table_.data()), cell);
  const auto line = hn::Add(hn::Mul(in_brick(u), number(kStride)), in_brick(v));
  const auto corner = hn::Add(hn::Mul(brick, number(kBrickValues)), hn::Add(hn::Mul(line, number(kStride)), in_brick(w)));
  const auto voxel = [&](int step) -> Pack {
    const auto value = hn::GatherIndex(singles, values_.data() + step, corner);
    if constexpr (sizeof(T) == sizeof(float))
      return value;
    else
      return hn::PromoteTo(hn::FixedTag<double, N>(), value);
  };
  const auto mix = [](Pack a, Pack b, Pack f) { return a + (b - a) * f; };
  const auto edge = [&](int step) { return mix(voxel(step), voxel(step + 1), z); };
  const auto face = [&](int step) { return mix(edge(step), edge(step + kSteps[1]), y); };
  return select(inside, mix(face(0), face(kSteps[0]), x), Pack(background_));
}

// Passes over the same tables, in the order in which memory is known.
template <class Bricks, class Fill, class ForEach>
BrickGrid BrickGrid::build(const IndexBox& box, float background, const Bricks& bricks, const Fill& fill,
                           const ForEach& for_each) {
  BrickGrid grid(box, background);
  const auto uniform = [](float value) {
    Corners corners;
    corners.fill(value);
    return uncut(corners);
  };
  std::map<Pattern, std::uint32_t> shared;
  std::vector<const Pattern*> patterns;
  const auto share = [&](const Pattern& pattern) {
    const auto [found, added] = shared.try_emplace(pattern, static_cast<std::uint32_t>(patterns.size()));
    if (added) patterns.push_back(&found->first);
    return found->second;
  };
  share(uniform(background));

  std::vector<std::size_t> filled;
  bricks(grid.first(), grid.shape_, [&](std::size_t begin, std::size_t end, const Corners* corners) {
    if (!corners) {
      for (std::size_t b = begin; b < end; ++b) filled.push_back(b);
      return;
    }
    // Only the ends of a row are cut by the box in ways of their own, and most rows are like the one before.
    const Index3 at = grid.origin(begin);
    const std::size_t row = grid.shape_[2];
    for (std::size_t b = begin, next; b < end; b = next) {
      const Index3 here = at + Index3(0, 0, kSide * static_cast<int>(b - begin));
      const Pattern pattern = grid.cut(*corners, here);
      const bool whole = here[2] >= box.lo[2] && here[2] + kSide <= box.hi[2];
      next = whole ? std::min(end, b + static_cast<std::size_t>((box.hi[2] - here[2]) / kSide)) : b + 1;
      const bool as_before = b >= row && grid.table_[b - row] < patterns.size() && *patterns[grid.table_[b - row]] == pattern;
      grid.table_.set(b, next, as_before ? grid.table_[b - row] : share(pattern));
    }
  });

  using Values = std::array<float, kBrickValues>;
  const auto load = [&](std::size_t b, Values& values) {
    const Index3 at = grid.origin(b);
    fill(at, values.data());
    grid.clear_outside(at, values.data());
  };
  // The one value of each brick, or NaN.  Counting before storing allocates exactly once.
  std::vector<float> only(filled.size());
  for_each(filled.size(), [&](std::size_t n) {
    Values values;
    load(filled[n], values);
    const auto bits = [](float v) { return std::bit_cast<std::uint32_t>(v); };
    const bool same = std::all_of(values.begin(), values.end(), [&](float v) { return bits(v) == bits(values[0]); });
    only[n] = same ? values[0] : std::numeric_limits<float>::quiet_NaN();
  });
  for (std::size_t n = 0; n < filled.size(); ++n)
    if (!std::isnan(only[n])) grid.table_.set(filled[n], filled[n] + 1, share(uniform(only[n])));
  auto count = static_cast<std::uint32_t>(patterns.size());
  for (std::size_t n = 0; n < filled.size(); ++n)
    if (std::isnan(only[n])) grid.table_.set(filled[n], filled[n] + 1, count++);

  grid.allocate(count);
  for (const auto& [pattern, brick] : shared) grid.store(brick, pattern);
  for_each(filled.size(), [&](std::size_t n) {
    if (!std::isnan(only[n])) return;
    Values values;
    load(filled[n], values);
    grid.store(grid.table_[filled[n]], values.data());
  });
  return grid;
}

template <class Predicate>
std::optional<Index3> BrickGrid::find(const Predicate& predicate) const {
  // What is stored is looked at once, however many places of the table share it.
  std::vector<char> holds(summaries_.size());
  for (std::size_t brick = 0; brick < holds.size(); ++brick) {
    const float* const values = values_.data() + brick * kBrickValues;
    holds[brick] = std::any_of(values, values + kBrickValues, predicate);
  }
  if (std::find(holds.begin(), holds.end(), 1) == holds.end()) return std::nullopt;
  std::optional<Index3> first;
  for (std::size_t b = 0; b < table_.size(); ++b) {
    if (!holds[table_[b]]) continue;
    const float* const values = values_.data() + std::size_t{table_[b]} * kBrickValues;
    const Index3 low = origin(b);
    for (int i = 0; i < kSide; ++i)
      for (int j = 0; j < kSide; ++j)
        for (int k = 0; k < kSide; ++k) {
          const Index3 at = low + Index3(i, j, k);
          if (!predicate(values[i * kSteps[0] + j * kSteps[1] + k]) || !box_.contains({at, at})) continue;
          if (!first || std::lexicographical_compare(at.begin(), at.end(), first->begin(), first->end())) first = at;
        }
  }
  return first;
}

}  // namespace nullmark
