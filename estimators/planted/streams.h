#pragma once

#include "estimators/planted/wrapped.h"
#include "estimators/ratio.h"

namespace nullmark {

/// Samples 2k and 2k + 1 draw from stream k.
class PairedStreams final : public WrappedKernel {
 public:
  using WrappedKernel::WrappedKernel;

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    out.values.clear();
    out.lookups.clear();
    SampleBlock one;
    for (std::size_t i = 0; i < count; ++i) {
      WrappedKernel::sample(workspace, medium, context, key, (first + i) / 2, 1, quantity, one, counters);
      out.values.insert(out.values.end(), one.values.begin(), one.values.end());
      out.lookups.push_back(one.lookups[0]);
    }
  }
};

/// Ratio tracking whose samples share their draws in pairs, as when a seed loses its lowest bit.  Every sample has the right law;
/// the mean of n has the variance of n/2.
template <class Value>
struct PlantedPairedStreams : RatioTracking<Value> {
  static constexpr const char* kName = "planted_paired_streams";
  static constexpr const char* kSummary = "wrong: ratio tracking whose samples share random numbers in pairs";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "independence";

  static std::unique_ptr<const Kernel> wrap(std::unique_ptr<const Kernel> honest) {
    return std::make_unique<PairedStreams>(std::move(honest));
  }
};

/// Every ray draws from ray 0's streams.
class OneRaysStreams final : public WrappedKernel {
 public:
  using WrappedKernel::WrappedKernel;

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    PreparedRay renumbered = context;
    renumbered.index = 0;
    WrappedKernel::sample(workspace, medium, renumbered, key, first, count, quantity, out, counters);
  }
};

/// Ratio tracking seeded by the sample alone: all rays of an image see the same random numbers.  Each ray's statistics are right,
/// the image's mean is as noisy as one ray's.
template <class Value>
struct PlantedRayStreams : RatioTracking<Value> {
  static constexpr const char* kName = "planted_ray_streams";
  static constexpr const char* kSummary = "wrong: ratio tracking whose rays all use the first ray's random numbers";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "independence";

  static std::unique_ptr<const Kernel> wrap(std::unique_ptr<const Kernel> honest) {
    return std::make_unique<OneRaysStreams>(std::move(honest));
  }
};

/// Streams are numbered within a call, not within a ray.
class CallStreams final : public WrappedKernel {
 public:
  using WrappedKernel::WrappedKernel;

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    WrappedKernel::sample(workspace, medium, context, key, 0, count, quantity, out, counters);
  }
};

/// Ratio tracking that seeds each batch of samples anew: a sample depends on how the plan was cut into batches, and batches
/// repeat one another.
template <class Value>
struct PlantedBatchStreams : RatioTracking<Value> {
  static constexpr const char* kName = "planted_batch_streams";
  static constexpr const char* kSummary = "wrong: ratio tracking that starts its streams anew in each batch of samples";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "replay";

  static std::unique_ptr<const Kernel> wrap(std::unique_ptr<const Kernel> honest) {
    return std::make_unique<CallStreams>(std::move(honest));
  }
};

}  // namespace nullmark
