#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/kernel/given_samples.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {

/// Pictures of one scene, each with a seed of its own.  The pixels of a picture may share random numbers, so a picture gives one
/// sample of each group of pixels: the mean over the group.  Group 0 is all pixels, the others are the groups of `ray_groups`.
class PixelGroups {
 public:
  PixelGroups(const BuiltRays& rays, int channels);

  /// One picture, [ray * channels + c].
  void add(std::span<const Real> picture);

  std::size_t groups() const { return pixels_.size(); }
  std::uint64_t pictures() const { return pictures_; }
  const std::vector<std::size_t>& pixels(std::size_t group) const { return pixels_[group]; }

  /// The samples of one group and channel, as those of one grey ray.
  std::shared_ptr<const GivenSamples> samples(std::size_t group, std::size_t channel) const;

 private:
  std::size_t channels_;
  std::uint64_t pictures_ = 0;
  std::vector<std::vector<std::size_t>> pixels_;
  std::vector<Real> means_;  ///< [(picture * groups + group) * channels + c]
};

/// What the pictures' cell says of its estimator, for its records.
struct PictureSource {
  std::string name;
  std::uint64_t hash = 0;
  SampleRange range = SampleRange::any_sign;
};

/// The cell of one group and channel: one grey ray, whose reference is the mean over the group's pixels of the exact values of
/// `whole`, a cell whose scene is built.
PreparedCell group_cell(const PreparedCell& whole, const PixelGroups& pictures, std::size_t group, std::size_t channel,
                        const PictureSource& source);

}  // namespace nullmark
