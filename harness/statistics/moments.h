#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Power sums of the errors x - reference of one ray and channel.  Subtracting the reference keeps the variance accurate even if
/// it is small beside the mean.  Sums of shards add.
struct Moments {
  Real s1 = 0, s2 = 0, s3 = 0, s4 = 0;
  std::uint64_t count = 0;

  /// Sums in eight lanes on every machine, so the last digits do not depend on the width of its registers.
  void add(std::span<const Real> errors);

  Moments& operator+=(const Moments& other) {
    s1 += other.s1;
    s2 += other.s2;
    s3 += other.s3;
    s4 += other.s4;
    count += other.count;
    return *this;
  }

  /// Mean error; 0 without samples.
  Real mean() const { return count ? s1 / static_cast<Real>(count) : 0; }

  /// Unbiased sample variance; 0 with fewer than two samples.
  Real variance() const {
    if (count < 2) return 0;
    const auto n = static_cast<Real>(count);
    return std::max<Real>(0, (s2 - s1 * s1 / n) / (n - 1));
  }
};

/// Squared errors of sixteen disjoint parts of a cell's samples.  The part of a sample depends only on the numbers of rays and
/// samples, so parts of estimators with the same streams can be paired.
struct BlockErrors {
  static constexpr std::size_t kBlocks = 16;

  /// Adds the next errors of a ray, which are added to its moments as well: consecutive errors to each block, or all to the block
  /// of the ray if they are few.
  void add(std::size_t ray, std::span<const Real> errors, Moments& moments);

  BlockErrors& operator+=(const BlockErrors& other) {
    for (std::size_t b = 0; b < kBlocks; ++b) {
      squares[b] += other.squares[b];
      count[b] += other.count[b];
    }
    return *this;
  }

  std::array<Real, kBlocks> squares{};
  std::array<std::uint64_t, kBlocks> count{};
};

/// Squared errors of the means of 1, 2, 4, ... consecutive samples, over all disjoint groups of each size.  A group has samples
/// of one ray only; `finish_ray` drops incomplete groups.
class GroupErrors {
 public:
  struct Level {
    Real sum_of_squares = 0;
    std::uint64_t groups = 0;
  };

  GroupErrors() = default;
  /// Complete groups that were counted before.
  explicit GroupErrors(std::vector<Level> levels) : levels_(std::move(levels)) {
    pending_.resize(levels_.size(), 0);
    has_pending_.resize(levels_.size(), false);
  }

  /// Adds the next errors of a ray.  Their number is the same power of two each time; the last call may have fewer.
  void add(std::span<const Real> errors);

  /// Adds a complete group of 2^level samples whose errors sum to `sum`; a binary counter combines it with earlier groups.
  void carry(std::size_t level, Real sum) {
    for (;; ++level) {
      reach(level);
      const Real mean = std::ldexp(sum, -static_cast<int>(level));
      levels_[level].sum_of_squares += mean * mean;
      ++levels_[level].groups;
      if (!has_pending_[level]) {
        pending_[level] = sum;
        has_pending_[level] = true;
        return;
      }
      sum += pending_[level];
      has_pending_[level] = false;
    }
  }

  void finish_ray() { has_pending_.assign(has_pending_.size(), false); }

  GroupErrors& operator+=(const GroupErrors& other) {
    if (!other.levels_.empty()) reach(other.levels_.size() - 1);
    for (std::size_t i = 0; i < other.levels_.size(); ++i) {
      levels_[i].sum_of_squares += other.levels_[i].sum_of_squares;
      levels_[i].groups += other.levels_[i].groups;
    }
    return *this;
  }

  /// Takes the levels above `level` from another set whose groups start there.
  void append_above(std::size_t level, const GroupErrors& other) {
    for (std::size_t i = level + 1; i < other.levels_.size(); ++i) {
      reach(i);
      levels_[i].sum_of_squares += other.levels_[i].sum_of_squares;
      levels_[i].groups += other.levels_[i].groups;
    }
  }

  const std::vector<Level>& levels() const { return levels_; }

 private:
  void add_few(std::span<const Real> errors);
  void reach(std::size_t level) {
    if (level < levels_.size()) return;
    levels_.resize(level + 1);
    pending_.resize(level + 1, 0);
    has_pending_.resize(level + 1, false);
  }

  std::vector<Level> levels_;
  std::vector<Real> pending_;
  std::vector<bool> has_pending_;
};

}  // namespace nullmark
