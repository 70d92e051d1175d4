#include "harness/sampling/kept_samples.h"

#include <algorithm>

namespace nullmark {
namespace {

/// One sample in so many is kept, and so many of a cell.
constexpr std::uint64_t kOneIn = 128, kFewest = 32, kMost = 4096;

/// What a tracker learns it learns at first.
constexpr std::uint64_t kOpening = 16;

}  // namespace

KeptSamples::KeptSamples(std::size_t rays, std::uint64_t first, std::uint64_t per_ray, std::size_t outputs)
    : all_rays_(rays), outputs_(outputs), first_(first), per_ray_(per_ray) {
  if (rays == 0 || per_ray == 0) return;
  const std::uint64_t wanted = std::clamp(per_ray / kOneIn * rays + per_ray % kOneIn * rays / kOneIn, kFewest, kMost);
  opening_ = static_cast<std::size_t>(std::min(per_ray, kOpening));
  rays_ = static_cast<std::size_t>(std::min<std::uint64_t>(rays, wanted / 2));
  each_ = static_cast<std::size_t>(std::min<std::uint64_t>(per_ray, wanted / rays_));
  values_.resize(count() * outputs);
}

void KeptSamples::keep(std::size_t of_ray, std::uint64_t from, std::uint64_t count, std::span<const Real> values) {
  const auto take = [&](std::size_t slot, std::uint64_t sample) {
    std::copy_n(&values[(sample - from) * outputs_], outputs_, &values_[slot * outputs_]);
  };
  if (of_ray == 0)
    for (std::uint64_t sample = std::max(from, first_); sample < std::min(from + count, first_ + opening_); ++sample)
      take(static_cast<std::size_t>(sample - first_), sample);
  // The kept ray that is this one, if any is.
  const std::size_t i = (of_ray * rays_ + all_rays_ - 1) / all_rays_;
  if (i >= rays_ || ray(i) != of_ray) return;
  std::size_t j = each_ > 1 ? static_cast<std::size_t>((from - first_) * (each_ - 1) / (per_ray_ - 1)) : 0;
  for (; j < each_ && number(j) < from + count; ++j)
    if (number(j) >= from) take(opening_ + i * each_ + j, number(j));
}

KeptSamples::Sample KeptSamples::at(std::size_t i) const {
  const std::span<const Real> values(&values_[i * outputs_], outputs_);
  if (i < opening_) return {0, first_ + i, values};
  return {ray((i - opening_) / each_), number((i - opening_) % each_), values};
}

void KeptSamples::set(std::size_t i, std::span<const Real> values) {
  std::copy_n(values.begin(), outputs_, &values_[i * outputs_]);
}

}  // namespace nullmark
