#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Values of some samples of a cell, as its run drew them: the first 16 of ray 0, and evenly spaced samples of up to 2048 evenly
/// spaced rays.  About one sample in 128, at least 32 and at most 4096 per cell.
///
/// Threads may concurrently keep samples of different rays, or of different parts of one ray.
class KeptSamples {
 public:
  KeptSamples() = default;
  /// For samples first .. first + per_ray - 1 of every ray.
  KeptSamples(std::size_t rays, std::uint64_t first, std::uint64_t per_ray, std::size_t outputs);

  /// Selects what to keep from samples from .. from + count - 1 of a ray; values[i * outputs + o].
  void keep(std::size_t ray, std::uint64_t from, std::uint64_t count, std::span<const Real> values);

  struct Sample {
    std::size_t ray;
    std::uint64_t number;  ///< sample index in the address of its random stream
    std::span<const Real> values;
  };
  std::size_t count() const { return opening_ + rays_ * each_; }
  /// By ray, then by sample; the first 16 of ray 0 come first.
  Sample at(std::size_t i) const;
  /// Gives the i-th sample its values.
  void set(std::size_t i, std::span<const Real> values);

 private:
  std::uint64_t number(std::uint64_t j) const { return each_ > 1 ? first_ + j * (per_ray_ - 1) / (each_ - 1) : first_; }
  std::size_t ray(std::size_t i) const { return i * all_rays_ / rays_; }

  std::size_t all_rays_ = 0, outputs_ = 1;
  std::uint64_t first_ = 0, per_ray_ = 0;
  std::size_t opening_ = 0;  ///< of ray 0, those that begin the cell
  std::size_t rays_ = 0;     ///< of which samples are kept
  std::size_t each_ = 0;     ///< of each of them
  std::vector<Real> values_;
};

}  // namespace nullmark
