#include "media/volumes/brick_grid.h"

#include <bit>

#include "media/volumes/brick_grid_summary.h"
#include "media/volumes/machine_memory.h"

namespace nullmark {

namespace {

int aligned_down(int i) { return i & ~(BrickGrid::kSide - 1); }

}  // namespace

BrickGrid::BrickGrid(const IndexBox& box, float background) : background_(background), box_(box) {
  const auto text = [](auto number) { return std::to_string(number); };
  std::int64_t bricks = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int lo = box.lo[axis], hi = box.hi[axis];
    if (lo > hi || lo < -kMaxIndex || hi > kMaxIndex)
      throw std::length_error("voxel indices " + text(lo) + ".." + text(hi) + " on axis " + text(axis) +
                              "; expected a non-empty range within +-" + text(kMaxIndex));
    const auto a = static_cast<std::size_t>(axis);
    table_lo_[a] = aligned_down(lo - 1);
    table_hi_[a] = aligned_down(hi) + kSide;
    const std::int64_t side = (std::int64_t{table_hi_[a]} - table_lo_[a]) / kSide;
    shape_[a] = static_cast<std::size_t>(side);
    // Each side is below 2^29: dividing first keeps the product from overflowing.
    bricks = side > kMaxBricks / bricks ? kMaxBricks + 1 : bricks * side;
    if (bricks > kMaxBricks) break;
  }
  if (bricks > kMaxBricks)
    throw std::length_error("bounding box of " + text(std::int64_t{box.hi[0]} - box.lo[0] + 1) + " x " +
                            text(std::int64_t{box.hi[1]} - box.lo[1] + 1) + " x " +
                            text(std::int64_t{box.hi[2]} - box.lo[2] + 1) + " voxels exceeds the limit of " + text(kMaxBricks) +
                            " bricks of 8^3");
  table_ = SparseTable(static_cast<std::size_t>(bricks));
}

Index3 BrickGrid::origin(std::size_t table_index) const {
  const std::size_t k = table_index % shape_[2], ij = table_index / shape_[2];
  return Index3(table_lo_[0], table_lo_[1], table_lo_[2]) +
         kSide * Index3(static_cast<int>(ij / shape_[1]), static_cast<int>(ij % shape_[1]), static_cast<int>(k));
}

BrickGrid::Pattern BrickGrid::uncut(const Corners& corners) {
  Pattern pattern{};
  std::transform(corners.begin(), corners.end(), pattern.begin(), [](float v) { return std::bit_cast<std::uint32_t>(v); });
  for (std::size_t axis = 0; axis < 3; ++axis) pattern[9 + 2 * axis] = kSide;
  return pattern;
}

BrickGrid::Pattern BrickGrid::cut(const Corners& corners, const Index3& origin) const {
  Pattern pattern = uncut(corners);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    pattern[8 + 2 * a] = static_cast<std::uint32_t>(std::max(box_.lo[axis] - origin[axis], 0));
    pattern[9 + 2 * a] = static_cast<std::uint32_t>(std::min(box_.hi[axis] - origin[axis], kSide));
  }
  return pattern;
}

void BrickGrid::clear_outside(const Index3& origin, float* values) const {
  if (box_.contains({origin, origin + Index3::Constant(kSide)})) return;
  for (int i = 0; i < kStride; ++i)
    for (int j = 0; j < kStride; ++j)
      for (int k = 0; k < kStride; ++k) {
        const Index3 at = origin + Index3(i, j, k);
        if (!box_.contains({at, at})) values[i * kSteps[0] + j * kSteps[1] + k] = background_;
      }
}

void BrickGrid::allocate(std::int64_t bricks) {
  const std::int64_t bytes = bricks * std::int64_t{kBrickValues * sizeof(float)};
  if (bytes > kMaxValueBytes)
    throw std::length_error("voxel values of " + std::to_string(bytes >> 20) + " MiB exceed the limit of " +
                            std::to_string(kMaxValueBytes >> 20) + " MiB");
  // Beyond it the system would end the program, here or later, without a word.
  const std::int64_t machine = static_cast<std::int64_t>(machine_memory());
  if (bytes > machine)
    throw std::length_error("voxel values of " + std::to_string(bytes >> 20) + " MiB exceed this machine's memory of " +
                            std::to_string(machine >> 20) + " MiB");
  values_.resize(static_cast<std::size_t>(bricks) * kBrickValues);
  summaries_.resize(static_cast<std::size_t>(bricks));
}

void BrickGrid::store(std::size_t brick, const float* values) {
  std::copy(values, values + kBrickValues, values_.begin() + static_cast<std::ptrdiff_t>(brick * kBrickValues));
  BrickSummary& summary = summaries_[brick] = {values[0], values[0], 0};
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j)
      for (int k = 0; k < kSide; ++k) {
        const float v = values[i * kSteps[0] + j * kSteps[1] + k];
        summary.minimum = std::min(summary.minimum, v);
        summary.maximum = std::max(summary.maximum, v);
        summary.sum += v;
      }
}

void BrickGrid::store(std::size_t brick, const Pattern& pattern) {
  const auto in_box = [&](std::size_t axis, int at) {
    const auto n = static_cast<std::uint32_t>(at);
    return pattern[8 + 2 * axis] <= n && n <= pattern[9 + 2 * axis];
  };
  std::array<float, kBrickValues> values;
  auto value = values.begin();
  for (int i = 0; i < kStride; ++i)
    for (int j = 0; j < kStride; ++j)
      for (int k = 0; k < kStride; ++k) {
        const std::size_t corner = (i == kSide ? 4u : 0u) + (j == kSide ? 2u : 0u) + (k == kSide ? 1u : 0u);
        *value++ = in_box(0, i) && in_box(1, j) && in_box(2, k) ? std::bit_cast<float>(pattern[corner]) : background_;
      }
  store(brick, values.data());
}

std::size_t BrickGrid::bytes() const {
  return sizeof *this + table_.size() * sizeof(std::uint32_t) + values_.size() * sizeof values_[0] +
         summaries_.size() * sizeof summaries_[0];
}

std::uint64_t BrickGrid::content_hash() const {
  std::vector<std::uint64_t> bricks(summaries_.size());
  for (std::size_t b = 0; b < bricks.size(); ++b)
    for (int v = 0; v < kBrickValues; ++v)
      bricks[b] = hash_mixed(bricks[b], std::bit_cast<std::uint32_t>(values_[b * kBrickValues + static_cast<std::size_t>(v)]));
  std::uint64_t hash = std::bit_cast<std::uint32_t>(background_);
  for (int axis = 0; axis < 3; ++axis) {
    hash = hash_mixed(hash, static_cast<std::uint32_t>(box_.lo[axis]));
    hash = hash_mixed(hash, static_cast<std::uint32_t>(box_.hi[axis]));
  }
  for (std::size_t b = 0; b < table_.size(); ++b) {
    hash = hash_mixed(hash, bricks[table_[b]]);
    if (table_[b] != 0) continue;
    // A chain has to be gone through, but without a look at every place.
    for (const std::size_t end = table_.unset_until(b + 1, table_.size()); b + 1 < end; ++b) hash = hash_mixed(hash, bricks[0]);
  }
  return hash;
}

RangeSummary BrickGrid::summary(const IndexBox& range) const {
  const auto count = [&](int axis) { return static_cast<Real>(range.hi[axis]) - range.lo[axis] + 1; };
  return summary(
      range, [](int, int) { return Real{1}; }, count(0) * count(1) * count(2));
}

}  // namespace nullmark
