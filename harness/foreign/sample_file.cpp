#include "harness/foreign/sample_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>

#include "harness/foreign/ascii_line.h"
#include "harness/foreign/content_hash.h"
#include "harness/foreign/foreign_entry.h"
#include "harness/io/json_input.h"
#include "harness/io/npy.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

/// Throws InputError for a header that is not one of samples.
SampleShape shape_of(const NpyHeader& header, const std::string& path) {
  const auto& shape = header.shape;
  if (shape.size() != 2 && shape.size() != 3)
    throw InputError(
        fmt::format("{}: found {} dimensions; expected (samples, rays), or (samples, rays, channels)", path, shape.size()));
  const SampleShape found{shape[0], shape[1], shape.size() > 2 ? shape[2] : 1};
  if (header.numbers == 0) throw InputError(path + ": holds no samples");
  if (found.channels > kMaxChannels)
    throw InputError(fmt::format("{}: found {} channels; expected at most {}", path, found.channels, kMaxChannels));
  return found;
}

void expect_memory(const NpyHeader& header, const std::string& path) {
  const auto pages = ::sysconf(_SC_PHYS_PAGES), each = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || each <= 0) return;
  const std::uint64_t bytes = header.numbers * header.bytes_per_number,
                      most = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(each);
  if (bytes > most)
    throw InputError(fmt::format("{}: holds {} bytes; the machine has memory for {}; hand in fewer samples", path, bytes, most));
}

}  // namespace

SampleRange range_named(const std::string& name) {
  if (name == "binary") return SampleRange::binary;
  if (name == "unit") return SampleRange::unit;
  return name == "non_negative" ? SampleRange::non_negative : SampleRange::any_sign;
}

SampleShape read_sample_shape(const std::string& path) { return shape_of(read_npy_header(path), path); }

namespace {

/// Calls visit(sample, ray, channel, number) for all numbers in their order.
template <class Visit>
void for_each_number(const std::string& path, const NpyHeader& header, const SampleShape& shape, Visit&& visit) {
  std::uint64_t sample = 0;
  std::size_t ray = 0, channel = 0;
  read_npy(path, header, [&](std::uint64_t, std::span<const Real> numbers) {
    for (const Real number : numbers) {
      visit(sample, ray, channel, number);
      if (++channel < shape.channels) continue;
      channel = 0;
      if (++ray < shape.rays) continue;
      ray = 0;
      ++sample;
    }
  });
}

/// Sums from which a variance is had, of numbers less the first of them.
struct Spread {
  Real first = 0, sum = 0, squares = 0;
  std::uint64_t count = 0;
  void add(Real x) {
    if (count++ == 0) first = x;
    sum += x - first;
    squares += (x - first) * (x - first);
  }
  Real variance() const { return std::max<Real>(0, squares - sum * sum / static_cast<Real>(count)) / static_cast<Real>(count); }
};

}  // namespace

namespace {

/// Whether a number may be a sample, the rounding of floats allowed for.
bool may_be_sample(Real number, SampleRange range) {
  constexpr Real kSlack = 1e-6;
  if (!std::isfinite(number)) return false;
  if (range == SampleRange::any_sign) return true;
  if (range == SampleRange::binary) return number == 0 || number == 1;
  return number >= -kSlack && (range == SampleRange::non_negative || number <= 1 + kSlack);
}

}  // namespace

std::shared_ptr<const GivenSamples> read_samples(const std::string& path, SampleRange range) {
  const NpyHeader header = read_npy_header(path);
  const SampleShape shape = shape_of(header, path);
  expect_memory(header, path);
  auto samples = std::make_shared<GivenSamples>(static_cast<std::size_t>(shape.rays), static_cast<std::size_t>(shape.channels),
                                                shape.samples, header.bytes_per_number == sizeof(float));
  for_each_number(path, header, shape, [&](std::uint64_t sample, std::size_t ray, std::size_t channel, Real number) {
    // The pilot's samples are held to it as well, or a file that is half wrong could pass.
    if (!may_be_sample(number, range))
      throw InputError(fmt::format("{}: sample {} of ray {} is {}; expected {}", path, sample, ray, number,
                                   std::isfinite(number) ? fmt::format("the stated range, {}", to_string(range)) : "a number"));
    samples->set(ray, sample, channel, number);
  });
  return samples;
}

Real shared_variance(const std::string& path) {
  const NpyHeader header = read_npy_header(path);
  const SampleShape shape = shape_of(header, path);
  const auto rays = static_cast<std::size_t>(shape.rays), channels = static_cast<std::size_t>(shape.channels);
  std::vector<Spread> of_rays(rays * channels), of_rows(channels);
  std::vector<Real> row(channels);
  for_each_number(path, header, shape, [&](std::uint64_t, std::size_t ray, std::size_t channel, Real number) {
    of_rays[ray * channels + channel].add(number);
    row[channel] += number;
    if (ray + 1 < rays) return;
    of_rows[channel].add(row[channel]);
    row[channel] = 0;
  });
  Real most = 1;
  for (std::size_t c = 0; c < channels; ++c) {
    Real independent = 0;
    for (std::size_t ray = 0; ray < rays; ++ray) independent += of_rays[ray * channels + c].variance();
    if (independent > 0) most = std::max(most, of_rows[c].variance() / independent);
  }
  return most;
}

namespace {

/// An estimator whose samples somebody else has drawn.  No code runs, so no consent is asked for.
class SamplesSource final : public EstimatorSource {
 public:
  static constexpr const char* kName = kSamplesType;
  static constexpr const char* kSummary = "samples from an .npy file, by harness/foreign/foreign.md";

  void parameters(ParameterVisitor& visit) override {
    visit.text("file", file_, "of shape (samples, rays) or (samples, rays, channels), relative to the configuration");
    visit.choice("range", range_, {"signed", "non_negative", "unit", "binary"}, "of the samples");
  }
  void locate(const std::string& folder) override { folder_ = folder; }

  Guarantee claim(Quantity) const override { return Guarantee::unbiased; }
  SampleRange range(int) const override { return range_named(range_); }
  bool needs_bound() const override { return false; }
  std::optional<Real> order(Quantity) const override { return std::nullopt; }
  void check(const MatterBounds&) const override {}

  std::unique_ptr<const Kernel> kernel(int channels, Precision precision, bool) const override {
    if (precision == Precision::float32) return nullptr;
    const std::shared_ptr<const GivenSamples>& given = samples();
    if (given->channels() != static_cast<std::size_t>(channels))
      throw ParameterError("file", fmt::format("{}: found {} channels; the medium has {}", file_, given->channels(), channels));
    return make_given_samples_kernel(given);
  }

  /// Nobody counted lookups, and to read a number twice proves nothing.
  std::optional<TrackerIdentity> identity() const override {
    samples();
    return TrackerIdentity{ascii_line(std::filesystem::path(file_).filename().string()), "", hash_, true, false};
  }

 private:
  const std::shared_ptr<const GivenSamples>& samples() const {
    const std::lock_guard lock(mutex_);
    if (samples_) return samples_;
    if (file_.empty()) throw ParameterError("file", "missing; expected the path of an .npy file");
    const std::string path = (std::filesystem::path(folder_) / file_).string();
    try {
      samples_ = read_samples(path, range_named(range_));
    } catch (const InputError& error) {
      throw ParameterError("file", error.what());
    }
    hash_ = content_hash(path);
    return samples_;
  }

  std::string file_, folder_, range_ = "signed";
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const GivenSamples> samples_;
  mutable std::uint64_t hash_ = 0;
};

[[maybe_unused]] const bool kSamplesRegistered =
    Registry<EstimatorEntry>::instance().add(foreign_entry<SamplesSource>({Quantity::transmittance, Quantity::optical_depth}));

}  // namespace
}  // namespace nullmark
