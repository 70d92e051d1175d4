#include "harness/verdict/walk_laws.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/statistics/ks_bound.h"

namespace nullmark {
namespace {

/// Rays that take part: all, or so many evenly spaced ones.
constexpr std::size_t kMostRays = 16;

/// Wealth of several bets, averaged.
class Wealth {
 public:
  explicit Wealth(std::vector<Real> rates) : rates_(std::move(rates)), logs_(2 * rates_.size(), 0) {}

  /// Bets on and against y of mean 0 and |y| <= 1/2; the wealth is NaN where a sample out of its range would make it negative.
  void bet(Real y) {
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      const Real stake = rates_[i] * y, in_range = std::abs(stake) < 1 ? 1 : std::numeric_limits<Real>::quiet_NaN();
      factors_[2 * i] *= (1 + stake) * in_range;
      factors_[2 * i + 1] *= (1 - stake) * in_range;
    }
    if (++bets_ % kBetsToALog == 0) take_logs();
  }

  Real log() {
    take_logs();
    return log_mean_exp(logs_);
  }

 private:
  static constexpr int kBetsToALog = 64;  ///< of factors from .2 to 1.8 a product of so many is a normal number

  void take_logs() {
    for (std::size_t i = 0; i < logs_.size(); ++i) {
      logs_[i] += std::log(factors_[i]);
      factors_[i] = 1;
    }
  }

  std::vector<Real> rates_, logs_, factors_ = std::vector<Real>(logs_.size(), 1);
  std::uint64_t bets_ = 0;
};

/// All that the walks of the chosen rays tell.
class LawTester {
 public:
  LawTester(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets, const CellTheory& theory)
      : cell_(cell), scene_(scene), kernel_(kernel), theory_(theory) {
    outputs_ = targets.outputs;
    const std::size_t rays = scene.rays->world.size();
    for (std::size_t i = 0; i < std::min(rays, kMostRays); ++i) rays_.push_back(i * rays / std::min(rays, kMostRays));
  }

  bool run(const LawBudget& budget, const std::function<bool()>& stop) {
    const Real each = std::max<Real>(1, theory_.lookups.value_or(budget.each));
    const auto samples = static_cast<std::uint64_t>(
        std::clamp<Real>(budget.lookups / (each * static_cast<Real>(rays_.size())), 4, static_cast<Real>(budget.most_per_ray)));
    const std::uint64_t batch = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(2e5 / each), 1, 256);
    const auto workspace = kernel_.workspace();
    const std::uint64_t key = stream_key(cell_, *scene_.medium);
    std::vector<Real> before, now;  // centred first flights of the ray before and of this one
    Recording recording;
    SampleBlock block;
    Counters counters;
    for (const std::size_t ray : rays_) {
      scene_.context(ray, kernel_, context_);
      kernel_.begin_ray(*workspace, *scene_.medium->medium, scene_.medium->extrema, context_);
      begin(ray, *workspace);
      now.clear();
      for (std::uint64_t done = 0; done < samples; done += batch) {
        if (stop()) return false;
        recording.restart();
        workspace->recording = &recording;
        kernel_.sample(*workspace, *scene_.medium->medium, context_, key, first_sample::kLaws + done,
                       std::min(batch, samples - done), cell_.quantity, block, counters);
        workspace->recording = nullptr;
        if (counters.overruns > 0) return false;
        for (std::size_t i = 0; i < recording.walks.size(); ++i) {
          take(recording.walks[i], &block.values[i * outputs_]);
          now.push_back(centred_flight(recording.walks[i]));
        }
      }
      for (std::size_t i = 1; i < now.size(); ++i) serial_.bet(now[i] * now[i - 1] / 2);
      for (std::size_t i = 0; i < std::min(before.size(), now.size()); ++i) across_.bet(before[i] * now[i] / 2);
      pairs_ += now.size();
      before = now;
    }
    return true;
  }

  const std::vector<std::size_t>& rays() const { return rays_; }

  std::vector<LawRecord> records() {
    std::vector<LawRecord> records;
    const auto add = [&](const char* name, Real log_e, std::uint64_t count) {
      if (count > 0 && log_e > -kInfinity) records.push_back({name, std::round(log_e * 1e4) / 1e4, count});
    };
    if (kernel_.flies()) {
      add("count", count_law(), collisions_ + 1);
      add("first", uniformity(first_), first_.size());
      if (!ended_early_) add("positions", uniformity(all_), all_.size());
      if (mapped_ > 0) add("mapping", badly_mapped_ ? kCertain : 0, mapped_);
      // Walks that all ended before their first flight have none to compare.
      if (flown_ > 0) add("independence", log_mean_exp(std::vector{serial_.log(), across_.log()}), pairs_);
    }
    add("conditional", conditional(), conditional_count_);
    return records;
  }

 private:
  void begin(std::size_t ray, const Workspace& workspace) {
    laws_.clear();
    // With many collisions no count comes often enough.
    constexpr Real kMostCollisions = 500;
    if (cell_.quantity == Quantity::transmittance && kernel_.states_count_law() && theory_.lookups.value_or(0) < kMostCollisions)
      laws_ =
          kernel_.count_law(workspace, make_profile(*scene_.medium->medium, scene_.rays->local[ray], context_.bounds.segments()));
    by_count_.emplace_back();

    Real depth = 0;
    depths_.clear();
    for (const Segment& segment : context_.bounds.segments()) {
      depths_.push_back(depth);
      if (segment.majorant > 0) depth += segment.majorant * (segment.end - segment.begin);
    }
    majorant_depth_ = depth;
  }

  void take(const Recording::Walk& walk, const Real* values) {
    const std::size_t n = walk.steps.size();
    const Real flown = std::min(walk.depth, walk.total_depth);
    collisions_ += n;
    flown_ += flown;
    ended_early_ = ended_early_ || walk.depth < walk.total_depth;
    // Whole walks: the first half of one is no uniform sample.
    const bool keep = all_.size() + n <= kMostPositions;
    for (const Recording::Step& step : walk.steps) {
      if (keep) all_.push_back(step.depth / walk.total_depth);
      // Residual flights have rates of their own.
      if (std::abs(walk.total_depth - majorant_depth_) > kMapping * majorant_depth_) continue;
      ++mapped_;
      // A distance far along the ray has lost the digits of its magnitude.
      const Real rounding = 4 * std::numeric_limits<Real>::epsilon() * std::abs(step.position) * step.rate;
      badly_mapped_ =
          badly_mapped_ || std::abs(depth_at(step.position) - step.depth) > kMapping * (1 + majorant_depth_) + rounding;
    }
    if (n > 0 && walk.total_depth > 0) first_.push_back(std::expm1(-walk.steps[0].depth) / std::expm1(-walk.total_depth));
    by_count(n, values);
  }

  Real depth_at(Real position) const {
    const auto& segments = context_.bounds.segments();
    const auto after = std::upper_bound(segments.begin(), segments.end(), position,
                                        [](Real t, const Segment& segment) { return t < segment.end; });
    if (after == segments.end()) return majorant_depth_;
    return depths_[static_cast<std::size_t>(after - segments.begin())] + after->majorant * (position - after->begin);
  }

  /// Standardised by what the number of collisions says, samples of one count have mean 0 and variance 1 - (first^2/second)^k.
  void by_count(std::size_t k, const Real* values) {
    if (laws_.empty() || k >= kMostCount) return;
    for (std::size_t c = 0; c < outputs_; ++c) {
      const CountLaw& law = laws_[c];
      if (!(law.second > 0) || !(law.depth > 0)) continue;
      const auto power = static_cast<Real>(k);
      const Real scale = law.factor * std::pow(law.second, power / 2);
      if (!(std::abs(scale) > 1e-280)) continue;
      const Real y = (values[c] - law.factor * std::pow(law.first, power)) / scale;
      const Real v = 1 - std::pow(law.first * law.first / law.second, power);
      ++conditional_count_;
      if (v < kExact) {
        impossible_ = impossible_ || !(std::abs(y) < kImpossible);
        continue;
      }
      std::vector<std::vector<Real>>& counts = by_count_.back();
      counts.resize(std::max(counts.size(), (k + 1) * outputs_));
      std::vector<Real>& list = counts[k * outputs_ + c];
      if (list.empty()) list.push_back(v);
      list.push_back(y);
    }
  }

  Real count_law() const {
    std::vector<Real> logs;
    for (const Real d : {-0.1, -0.03, -0.01, -0.003, 0.003, 0.01, 0.03, 0.1})
      logs.push_back(static_cast<Real>(collisions_) * std::log1p(d) - d * flown_);
    return log_mean_exp(logs);
  }

  Real conditional() const {
    if (impossible_) return kCertain;
    constexpr std::size_t kFewest = 30;
    std::vector<Real> logs;
    for (const auto& ray : by_count_)
      for (const std::vector<Real>& list : ray) {
        if (list.size() < kFewest) continue;
        const std::span<const Real> y(list.data() + 1, list.size() - 1);
        // The rate that is best at a fixed number of samples and levels from 1e-2 to 1e-12.
        const Real rate = 1 / std::sqrt(static_cast<Real>(y.size()) * list[0]);
        for (const int side : {-1, 1}) {
          const Bet bet{Bet::Kind::catoni, side, 0, 1.02 * list[0], {3 * rate, 7 * rate}, 1};
          std::vector<Real> won(bet.rates.size());
          bet_on(bet, y, won);
          for (std::size_t r = 0; r < won.size(); ++r) logs.push_back(won[r] - log_denominator(bet, bet.rates[r], y.size()));
        }
      }
    return log_mean_exp(logs);
  }

  /// e^{-depth} of the first collision, or of the whole flight where there is none, minus its mean (1 + e^{-2M})/2; and over its
  /// largest value, so that products of two lie in [-1, 1].
  static Real centred_flight(const Recording::Walk& walk) {
    if (!(walk.total_depth > 0)) return 0;
    const Real least = std::exp(-walk.total_depth);
    const Real x = walk.steps.empty() ? least : std::exp(-walk.steps[0].depth), mean = (1 + least * least) / 2;
    return (x - mean) / std::max(1 - mean, mean - least);
  }

  static constexpr std::size_t kMostPositions = 1 << 18, kMostCount = 4096;
  static constexpr Real kMapping = 1e-9, kExact = 1e-9, kImpossible = 1e-2;

  const Cell& cell_;
  const Scene& scene_;
  const Kernel& kernel_;
  const CellTheory& theory_;
  std::size_t outputs_ = 1;
  std::vector<std::size_t> rays_;
  PreparedRay context_;

  std::vector<CountLaw> laws_;                            // of the ray at hand, per channel
  std::vector<Real> depths_;                              // majorant depth at which its segments begin
  Real majorant_depth_ = 0;                               // of the ray
  std::vector<std::vector<std::vector<Real>>> by_count_;  // [ray][count * channels + c]: variance, then samples

  std::uint64_t collisions_ = 0, mapped_ = 0, pairs_ = 0, conditional_count_ = 0;
  Real flown_ = 0;
  bool ended_early_ = false, badly_mapped_ = false, impossible_ = false;
  std::vector<Real> first_, all_;
  Wealth serial_{{0.4, 1.6}}, across_{{0.4, 1.6}};
};

/// The rays cut into pieces, about one unit of the thickest channel's depth each, as a scene of its own.
Scene in_pieces(const Scene& scene, const std::vector<std::size_t>& rays) {
  constexpr int kMostPieces = 256;
  auto pieces = std::make_shared<BuiltRays>();
  for (const std::size_t ray : rays) {
    const Ray &world = scene.rays->world[ray], &local = scene.rays->local[ray];
    const Real depth = scene.reference->at(ray).maxCoeff();
    const int count = std::clamp(static_cast<int>(std::ceil(std::min<Real>(depth, kMostPieces))), 1, kMostPieces);
    for (int i = 0; i < count; ++i) {
      const Real from = world.begin + world.length() * i / count,
                 to = i + 1 == count ? world.end : world.begin + world.length() * (i + 1) / count;
      pieces->world.push_back(world);
      pieces->local.push_back(local);
      for (Ray* piece : {&pieces->world.back(), &pieces->local.back()}) {
        piece->begin = from;
        piece->end = to;
      }
    }
  }
  auto reference = std::make_shared<const Reference>(compute_reference(*scene.medium, *pieces));
  return {scene.medium, scene.majorant, pieces, reference, nullptr, bounds_everywhere(*scene.majorant->structure, *pieces)};
}

/// Means of the pieces of a ray, at as many samples as the budget gives.
std::optional<LawRecord> segments_law(const Cell& cell, const Scene& scene, const Kernel& kernel, SampleRange range,
                                      const CellTheory& theory, const std::vector<std::size_t>& rays, const LawBudget& budget,
                                      const std::function<bool()>& stop) {
  // The theory of a piece costs as much as its majorant is deep; some of the rays do where that is much.
  constexpr Real kDeepest = 4000;
  const auto some = static_cast<std::size_t>(
      std::clamp<Real>(kDeepest / std::max<Real>(1, theory.lookups.value_or(1)), 1, static_cast<Real>(rays.size())));
  std::vector<std::size_t> taken;
  for (std::size_t i = 0; i < some; ++i) taken.push_back(rays[i * rays.size() / some]);
  const Scene pieces = in_pieces(scene, taken);
  const Targets targets = compute_targets(pieces, kernel, cell.quantity);
  const std::vector<CellTheory> all = compute_theory(pieces, {{&kernel, cell.quantity, range, &targets}});
  if (all[0].ray_variance.empty()) return std::nullopt;
  // Every piece starts anew, however early a walk of the whole ray would end.
  const Real each = (1 + all[0].lookups.value_or(1)) * static_cast<Real>(pieces.rays->world.size());
  std::uint64_t samples = 16;
  while (samples < budget.most_per_ray && static_cast<Real>(2 * samples) * each <= budget.lookups) samples *= 2;
  Cell own = cell;
  own.samples_per_ray = samples;
  own.verdict = {};
  const TestPlan plan = plan_tests(own, pieces, targets, range, Guarantee::unbiased, all[0], std::nullopt, {});
  const auto sampled =
      sample_cell(own, pieces, kernel, targets, {.first = first_sample::kLaws, .per_ray = samples, .only_evidence = true}, &plan,
                  stop, [](double) {});
  if (!sampled) return std::nullopt;
  std::vector<Real> logs;
  for (std::size_t i = 0; i < plan.tests.size(); ++i) {
    if (plan.tests[i].channel == MeanTest::kLookups) continue;
    const TestRecord record = test_record(plan.tests[i], sampled->evidence[i]);
    logs.push_back(record.log_e_fail);
  }
  return LawRecord{"segments", std::round(log_mean_exp(logs) * 1e4) / 1e4, samples * pieces.rays->world.size(), Outcome::none};
}

}  // namespace

std::optional<std::vector<LawRecord>> test_laws(const Cell& cell, const Scene& scene, const Kernel& kernel,
                                                const Targets& targets, SampleRange range, const CellTheory& theory,
                                                const LawBudget& budget, const std::function<bool()>& stop) {
  LawTester tester(cell, scene, kernel, targets, theory);
  if (!tester.run(budget, stop)) return std::nullopt;
  std::vector<LawRecord> records = tester.records();
  if (cell.quantity == Quantity::transmittance && scene.rays->world.size() > 0)
    if (auto segments = segments_law(cell, scene, kernel, range, theory, tester.rays(), budget, stop))
      records.push_back(*segments);
  return records;
}

}  // namespace nullmark
