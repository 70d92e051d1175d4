#include "harness/io/consistency.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <utility>

#include "harness/model/metrics.h"

namespace nullmark {
namespace {

/// The figures of a cell, compared with what its other figures say.
class Comparison {
 public:
  Comparison(const CellRecord& record, const JsonNode& cell) : record_(record), cell_(cell) {}

  void expect_counts() const {
    const std::uint64_t each = record_.cell.samples_per_ray;
    // Of pictures a sample is the mean of a group of rays.
    const std::uint64_t drawn = each == 0 ? 0 : record_.samples / each;
    if (drawn < 1 || drawn > record_.rays || record_.samples % each != 0)
      fail("samples", fmt::format("{} samples of {} rays with {} each", record_.samples, record_.rays, each));
    const auto samples = static_cast<Real>(record_.samples);
    if (record_.nonfinite > 0) fail("nonfinite", fmt::format("{} samples that are not finite, and status ok", record_.nonfinite));
    if ((record_.majorant_violations > 0) != record_.largest_violation.has_value())
      fail("majorant_violations",
           fmt::format("{} violations, and {} largest one", record_.majorant_violations, record_.largest_violation ? "a" : "no"));
    if (record_.null_collisions_per_sample && record_.lookups_per_sample &&
        *record_.null_collisions_per_sample > *record_.lookups_per_sample * (1 + kRounding))
      fail("null_collisions_per_sample", fmt::format("{:.6g} null collisions of {:.6g} lookups a sample",
                                                     *record_.null_collisions_per_sample, *record_.lookups_per_sample));
    expect("lookups_per_sample", record_.lookups_per_sample, static_cast<Real>(record_.lookups) / samples, "lookups / samples");
    expect("rng_draws_per_sample", record_.draws_per_sample, static_cast<Real>(record_.draws) / samples, "rng_draws / samples");
    if (record_.verdict) expect_counts(*record_.verdict, drawn);
  }

  void expect_channel(std::size_t c) const {
    const ChannelRecord& channel = record_.channel[c];
    if (channel.mean && channel.reference && channel.bias)
      expect("bias", channel.bias, *channel.mean - *channel.reference, "the mean less the reference",
             kDigits * (std::abs(*channel.mean) + std::abs(*channel.reference)));
    // The square of a smaller error is none.
    constexpr Real kLeast = 1e-150;
    if (channel.rmse && channel.bias && *channel.rmse < std::abs(*channel.bias) * (1 - kRounding) - kLeast)
      fail("rmse", fmt::format("rmse {:.6g}, below the bias {:.6g}", *channel.rmse, *channel.bias));
    const Real most = static_cast<Real>(record_.samples) * (1 + kRounding);
    if (channel.kurtosis && !(*channel.kurtosis >= 1 - kRounding && *channel.kurtosis <= most))
      fail("kurtosis", fmt::format("kurtosis {:.6g}, which no {} samples have", *channel.kurtosis, record_.samples));
    if (const auto& best = best_variance(channel); best && channel.reference_rms && *channel.reference_rms > 0)
      expect("relative_variance", channel.relative_variance, *best / *channel.reference_rms / *channel.reference_rms,
             "variance / reference.rms^2");
    if (!record_.convergence.empty()) expect_convergence(c);
  }

 private:
  /// Figures that determine each other were summed in another order; a difference was computed before its terms became text.
  static constexpr Real kRounding = 1e-6, kDigits = 1e-9;

  [[noreturn]] void fail(const char* key, const std::string& found) const {
    cell_[key].fail(fmt::format("found {}; the file was changed, or is damaged: make the results again", found));
  }

  void expect(const char* key, const std::optional<Real>& figure, Real wanted, const char* meaning) const {
    expect(key, figure, wanted, meaning, kRounding * std::abs(wanted));
  }
  void expect(const char* key, const std::optional<Real>& figure, Real wanted, const char* meaning, Real allowed) const {
    if (!figure || !std::isfinite(wanted) || std::abs(*figure - wanted) <= allowed) return;
    fail(key, fmt::format("{} {:.9g}, and {:.9g} as {}", key, *figure, wanted, meaning));
  }

  void expect_counts(const VerdictRecord& verdict, std::uint64_t drawn) const {
    if (verdict.out_of_range > verdict.samples_per_ray * drawn * record_.channel.size())
      fail("verdict", fmt::format("{} samples out of range, more than there are", verdict.out_of_range));
    std::set<std::pair<int, int>> seen;
    for (const TestRecord& test : verdict.tests)
      if (test.channel >= static_cast<int>(record_.channel.size()) || !seen.emplace(test.channel, test.group).second)
        fail("verdict", fmt::format("a test of channel {} that does not exist, or a second one", test.channel));
      else if (test.group < 0 && test.samples != verdict.samples_per_ray * drawn)
        fail("verdict",
             fmt::format("a test of {} samples, and {} in each of {} rays", test.samples, verdict.samples_per_ray, drawn));
  }

  /// The errors of single samples, and of means of all samples.
  void expect_convergence(std::size_t c) const {
    const ChannelRecord& channel = record_.channel[c];
    const auto rmse = [&](const ConvergenceRecord& step) {
      return c < step.channel.size() ? step.channel[c].rmse : std::nullopt;
    };
    const std::uint64_t each = record_.cell.samples_per_ray;
    const std::optional<Real> single = rmse(record_.convergence.front()), all = rmse(record_.convergence.back());
    if (record_.convergence.back().samples == each && all) expect("rmse", channel.rmse, *all, "the last of convergence");
    if (!single || !channel.rmse || record_.convergence.front().samples != 1) return;
    const auto n = static_cast<Real>(each);
    // The mean square of single errors is the samples' variance about the ray's mean, and the square of that mean's error.
    const Real within = *single * *single - *channel.rmse * *channel.rmse;
    if (each > 1)
      expect("variance", channel.variance, within * n / (n - 1), "convergence and rmse tell", kRounding * *single * *single);
  }

  const CellRecord& record_;
  const JsonNode& cell_;
};

}  // namespace

void expect_consistent(const CellRecord& record, const JsonNode& cell) {
  if (record.status == Status::skipped && record.samples > 0)
    cell["samples"].fail(
        fmt::format("found {} samples of a cell that was skipped; the file was changed, or is damaged: make the results again",
                    record.samples));
  if (record.status != Status::ok) return;
  const Comparison comparison(record, cell);
  comparison.expect_counts();
  for (std::size_t c = 0; c < record.channel.size(); ++c) comparison.expect_channel(c);
}

}  // namespace nullmark
