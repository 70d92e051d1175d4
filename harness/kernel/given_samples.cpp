#include "harness/kernel/given_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace nullmark {

SampleSplit split_samples(std::uint64_t samples) {
  constexpr std::uint64_t kPilotShare = 8, kLeastPilot = 128, kLongestSum = 64;
  const std::uint64_t pilot = std::min(samples / 2, std::max(samples / kPilotShare, kLeastPilot));
  std::uint64_t judged = samples - pilot;
  if (judged >= kLongestSum) judged -= judged % kLongestSum;
  return {samples - judged, judged};
}

GivenSamples::GivenSamples(std::size_t rays, std::size_t channels, std::uint64_t samples, bool single)
    : rays_(rays), channels_(channels), samples_(samples) {
  const std::size_t numbers = rays * channels * static_cast<std::size_t>(samples);
  if (single)
    single_.resize(numbers);
  else
    values_.resize(numbers);
}

void GivenSamples::set(std::size_t ray, std::uint64_t sample, std::size_t channel, Real value) {
  if (values_.empty())
    single_[at(ray, sample) + channel] = static_cast<float>(value);
  else
    values_[at(ray, sample) + channel] = value;
}

void GivenSamples::copy(std::size_t ray, std::uint64_t first, std::size_t count, Real* out) const {
  const auto begin = static_cast<std::ptrdiff_t>(at(ray, first));
  if (values_.empty())
    std::copy_n(single_.begin() + begin, count * channels_, out);
  else
    std::copy_n(values_.begin() + begin, count * channels_, out);
}

void GivenSamples::copy_row(std::uint64_t sample, Real* out) const {
  for (std::size_t ray = 0; ray < rays_; ++ray) copy(ray, sample, 1, out + ray * channels_);
}

namespace {

class GivenSamplesKernel final : public Kernel {
 public:
  explicit GivenSamplesKernel(std::shared_ptr<const GivenSamples> samples)
      : samples_(std::move(samples)), split_(split_samples(samples_->samples())) {}

  std::optional<std::uint64_t> pilot_samples() const override { return split_.pilot; }

  bool needs_optical_depth() const override { return false; }
  bool needs_knots() const override { return false; }
  bool states_theory() const override { return false; }
  bool flies() const override { return false; }
  std::vector<Theory> theory(const Workspace&, const RayProfile&, Quantity) const override { return {}; }
  bool answers(Quantity quantity) const override {
    return quantity == Quantity::transmittance || quantity == Quantity::optical_depth;
  }
  std::unique_ptr<Workspace> workspace() const override { return std::make_unique<Workspace>(); }
  std::size_t outputs(Quantity, const PreparedRay&) const override { return samples_->channels(); }

  void begin_ray(Workspace&, const Medium&, const Extrema&, const PreparedRay& context) const override {
    if (context.index >= samples_->rays())
      throw std::runtime_error(fmt::format("the file has samples of {} rays; the scene has more", samples_->rays()));
  }

  void sample(Workspace&, const Medium&, const PreparedRay& context, std::uint64_t, std::uint64_t first, std::size_t count,
              Quantity, SampleBlock& out, Counters& counters) const override {
    const bool of_pilot = first >= first_sample::kPilot;
    const std::uint64_t from = of_pilot ? first - first_sample::kPilot : first, most = of_pilot ? split_.pilot : split_.judged;
    // A sample that is used twice would count as two.
    if (from > most || count > most - from)
      throw std::runtime_error(
          fmt::format("found {} samples of each ray to judge, after {} of the pilot; {} are asked for: expected "
                      "\"samples_per_ray\" of at most {} and a \"verdict\" of \"max_samples_per_ray\" {}",
                      split_.judged, split_.pilot, from + count, split_.judged, split_.judged));
    out.values.resize(count * samples_->channels());
    out.lookups.assign(count, 0);
    counters.samples += count;
    samples_->copy(context.index, of_pilot ? from : split_.pilot + from, count, out.values.data());
  }

 private:
  std::shared_ptr<const GivenSamples> samples_;
  SampleSplit split_;
};

}  // namespace

std::unique_ptr<const Kernel> make_given_samples_kernel(std::shared_ptr<const GivenSamples> samples) {
  return std::make_unique<GivenSamplesKernel>(std::move(samples));
}

}  // namespace nullmark
