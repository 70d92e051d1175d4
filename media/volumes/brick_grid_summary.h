#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "media/volumes/brick_grid.h"

namespace nullmark {

/// The voxels of a brick along one axis that a range meets.
struct BrickGrid::Stretch {
  int begin, end;  ///< inside the brick
  std::array<Real, kSide> weights;
  Real total;
  bool whole;  ///< every voxel, at weight 1
};

/// The bricks of the table that a range meets, per axis.
struct BrickGrid::Stretches {
  std::array<std::vector<Stretch>, 3> of_axis;
  std::array<std::size_t, 3> first{};
  bool outside = false;  ///< the range leaves the table
};

template <class Weights>
BrickGrid::Stretches BrickGrid::stretches(const IndexBox& range, const Weights& weights) const {
  Stretches result;
  result.outside = table_.empty();
  for (std::size_t a = 0; a < 3; ++a) {
    const int axis = static_cast<int>(a);
    const int lo = std::max(range.lo[axis], table_lo_[a]), hi = std::min(range.hi[axis], table_hi_[a] - 1);
    result.outside |= lo != range.lo[axis] || hi != range.hi[axis];
    if (lo > hi) continue;
    result.first[a] = static_cast<std::size_t>(lo - table_lo_[a]) / kSide;
    for (int at = lo - (lo - table_lo_[a]) % kSide; at <= hi; at += kSide) {
      Stretch s{std::max(lo - at, 0), std::min(hi - at + 1, kSide), {}, 0, true};
      for (int i = s.begin; i < s.end; ++i) {
        const Real w = s.weights[static_cast<std::size_t>(i)] = weights(axis, at + i);
        s.total += w;
        s.whole &= w == 1;
      }
      s.whole &= s.end - s.begin == kSide;
      result.of_axis[a].push_back(s);
    }
  }
  return result;
}

/// Extrema and the weighted sum of what a range meets.
struct BrickGrid::RangeSums {
  RangeSummary summary;
  Real sum = 0, covered = 0;

  void add_voxels(const float* values, const Stretch& x, const Stretch& y, const Stretch& z) {
    for (int i = x.begin; i < x.end; ++i)
      for (int j = y.begin; j < y.end; ++j) {
        const Real w = x.weights[static_cast<std::size_t>(i)] * y.weights[static_cast<std::size_t>(j)];
        for (int k = z.begin; k < z.end; ++k) {
          const Real v = values[i * kSteps[0] + j * kSteps[1] + k];
          include(v, v);
          sum += w * z.weights[static_cast<std::size_t>(k)] * v;
        }
      }
  }

  void include(Real low, Real high) {
    summary.minimum = std::min(summary.minimum, low);
    summary.maximum = std::max(summary.maximum, high);
  }
};

template <class Weights>
RangeSummary BrickGrid::summary(const IndexBox& range, const Weights& weights, Real weight) const {
  const Stretches met = stretches(range, weights);
  const auto& [of_x, of_y, of_z] = met.of_axis;
  bool outside = met.outside;
  RangeSums sums;
  for (std::size_t i = 0; i < of_x.size(); ++i) {
    const std::size_t slice = ((met.first[0] + i) * shape_[1] + met.first[1]) * shape_[2] + met.first[2];
    const std::size_t slice_end = std::min(slice + of_y.size() * shape_[2], table_.size());
    if (table_.unset_until(slice, slice_end) == slice_end) {
      outside = true;
      continue;
    }
    for (std::size_t j = 0; j < of_y.size(); ++j)
      for (std::size_t row = slice + j * shape_[2], end = row + of_z.size(), b = row; b < end; ++b) {
        const std::uint32_t brick = table_[b];
        if (brick == 0) {
          outside = true;
          b = std::max(b + 1, table_.unset_until(b + 1, end)) - 1;
          continue;
        }
        const Stretch &x = of_x[i], &y = of_y[j], &z = of_z[b - row];
        const BrickSummary& all = summaries_[brick];
        const Real w = x.total * y.total * z.total;
        sums.covered += w;
        const bool whole = x.whole && y.whole && z.whole;
        if (!whole && all.minimum != all.maximum) {
          sums.add_voxels(values_.data() + brick * kBrickValues, x, y, z);
          continue;
        }
        sums.include(all.minimum, all.maximum);
        sums.sum += whole ? all.sum : w * all.minimum;
      }
  }
  if (outside) {
    sums.include(background_, background_);
    sums.sum += background_ * (weight - sums.covered);
  }
  RangeSummary result = sums.summary;
  result.average = weight > 0 ? std::clamp(sums.sum / weight, result.minimum, result.maximum) : result.minimum;
  return result;
}

}  // namespace nullmark
