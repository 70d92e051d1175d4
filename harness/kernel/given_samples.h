#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "harness/kernel/kernel.h"

namespace nullmark {

/// How samples that cannot be drawn again are shared out: the first are the pilot, which plans the verdict; the rest are judged.
struct SampleSplit {
  std::uint64_t pilot = 0, judged = 0;
};

/// An eighth and at least 128 for the pilot, at most half.  The judged ones are a multiple of 64 where there are that many,
/// because low rates bet on sums of up to 64 errors.
SampleSplit split_samples(std::uint64_t samples);

/// Samples that somebody else has drawn, of rays or of groups of pixels.
class GivenSamples {
 public:
  GivenSamples(std::size_t rays, std::size_t channels, std::uint64_t samples, bool single);

  std::size_t rays() const { return rays_; }
  std::size_t channels() const { return channels_; }
  std::uint64_t samples() const { return samples_; }

  /// Sample i of all rays: [ray * channels + c].
  void copy_row(std::uint64_t sample, Real* out) const;

  void set(std::size_t ray, std::uint64_t sample, std::size_t channel, Real value);
  /// Samples first .. first + count - 1 of a ray, channel after channel.
  void copy(std::size_t ray, std::uint64_t first, std::size_t count, Real* out) const;

 private:
  std::size_t at(std::size_t ray, std::uint64_t sample) const {
    return (ray * static_cast<std::size_t>(samples_) + static_cast<std::size_t>(sample)) * channels_;
  }

  std::size_t rays_, channels_;
  std::uint64_t samples_;
  // One of them is filled.
  std::vector<float> single_;
  std::vector<Real> values_;
};

/// A kernel that hands out given samples, each for one use: from first_sample::kPilot on the pilot's, from 0 on those judged.  It
/// throws std::runtime_error where others are asked for.
std::unique_ptr<const Kernel> make_given_samples_kernel(std::shared_ptr<const GivenSamples> samples);

}  // namespace nullmark
