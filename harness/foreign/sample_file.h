#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "harness/kernel/given_samples.h"

namespace nullmark {

/// The type of the estimator whose samples are those of an .npy file: {"type": "samples", "file": "mine.npy", "range": "unit"}.
inline constexpr const char* kSamplesType = "samples";

/// The range of a name: "binary", "unit", "non_negative"; others are signed.
SampleRange range_named(const std::string& name);

/// The shape of a file of samples.
struct SampleShape {
  std::uint64_t samples = 0, rays = 0, channels = 1;
};

/// Reads the shape, (samples, rays) or (samples, rays, channels), from the file's header.  Throws InputError of one line.
SampleShape read_sample_shape(const std::string& path);

/// How many times as much the sums over the rays of a row vary as they would if the rays were independent, of the channel where
/// it is most: about 1 where they are.  1 where nothing varies.
Real shared_variance(const std::string& path);

/// Reads all samples.  Throws InputError of one line, also where they would not fit into the machine's memory, and for a sample
/// that is not finite or not of the range.
std::shared_ptr<const GivenSamples> read_samples(const std::string& path, SampleRange range = SampleRange::any_sign);

}  // namespace nullmark
