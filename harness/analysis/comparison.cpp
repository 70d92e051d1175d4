#include "harness/analysis/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "harness/config/cell_names.h"
#include "harness/io/json_input.h"
#include "harness/io/transport_json.h"
#include "harness/model/names.h"
#include "harness/statistics/moments.h"

namespace nullmark {
namespace {

std::string measurement_label(const Measurement& measurement) {
  std::string label = measurement.clamp ? "clamped" : "";
  if (measurement.quantise_bits > 0) label += fmt::format("{}{} bits", label.empty() ? "" : ", ", measurement.quantise_bits);
  return label;
}

Contest empty_contest(const CellRecord& record) {
  Contest contest;
  contest.quantity = to_string(record.cell.quantity);
  contest.medium = record.medium.label;
  contest.majorant = record.majorant.label;
  contest.rays = record.ray_set.label;
  contest.light = transport_label(record.cell.transport);
  contest.measurement = measurement_label(record.cell.measurement);
  contest.name = fmt::format("{} | {} | {} | {}", contest.quantity, contest.medium, contest.majorant, contest.rays);
  for (const std::string* part : {&contest.light, &contest.measurement})
    if (!part->empty()) contest.name += " | " + *part;
  return contest;
}

/// Trackers that stand twice in a contest are told apart by the first of these that differs among them.
void tell_apart(std::vector<Contender>& contenders, const std::vector<RunRecord>& runs) {
  std::map<std::string, std::vector<Contender*>> same;
  for (Contender& contender : contenders) same[contender.label].push_back(&contender);
  const auto traits = [&](const Contender& contender) {
    const Cell& cell = contender.record->cell;
    return std::array{fmt::format("seed:{}", cell.seed),
                      fmt::format("samples:{}", cell.samples_per_ray),
                      cell.experiment,
                      std::string(cell.own_streams ? "own streams" : "common streams"),
                      runs[contender.run].name,
                      fmt::format("file {}", contender.run + 1)};
  };
  for (auto& [label, those] : same) {
    if (those.size() == 1) continue;
    std::set<std::string> labels;
    for (std::size_t trait = 0; labels.size() < those.size() && trait < traits(*those[0]).size(); ++trait) {
      std::set<std::string> values;
      for (const Contender* contender : those) values.insert(traits(*contender)[trait]);
      if (values.size() == 1) continue;
      labels.clear();
      for (Contender* contender : those) labels.insert(contender->label += "/" + traits(*contender)[trait]);
    }
  }
}

/// Reachable in a known time.
bool has_time(const Contender& contender) { return contender.seconds[0] && std::isfinite(contender.seconds[0]->value); }

bool claims_unbiased(const Contender& contender) {
  return contender.record->claims == "unbiased" && contender.record->cell.measurement == Measurement{};
}

void rank(std::vector<Contender>& contenders) {
  const auto key = [](const Contender& contender) { return has_time(contender) ? contender.seconds[0]->value : kInfinity; };
  std::stable_sort(contenders.begin(), contenders.end(), [&](const Contender& a, const Contender& b) { return key(a) < key(b); });
  for (Contender& contender : contenders) {
    if (!has_time(contender)) continue;
    contender.rank = 1 + std::count_if(contenders.begin(), contenders.end(), [&](const Contender& other) {
                       return has_time(other) && quotient(*contender.seconds[0], *other.seconds[0]).low > 1;
                     });
  }
  const auto place = [](const Contender& contender) { return contender.rank.value_or(std::numeric_limits<std::size_t>::max()); };
  std::stable_sort(contenders.begin(), contenders.end(),
                   [&](const Contender& a, const Contender& b) { return place(a) < place(b); });
  for (Contender& contender : contenders)
    contender.tied = contender.rank && std::count_if(contenders.begin(), contenders.end(),
                                                     [&](const Contender& other) { return other.rank == contender.rank; }) > 1;
}

void mark_pareto(std::vector<Contender>& contenders) {
  for (Contender& one : contenders) {
    if (!one.cost || !one.cost->ns_per_sample) continue;
    const auto beats = [&](const Contender& other) {
      if (!other.cost || !other.cost->ns_per_sample) return false;
      const Real variance = one.cost->variance.value - other.cost->variance.value;
      const Real time = one.cost->ns_per_sample->value - other.cost->ns_per_sample->value;
      return variance >= 0 && time >= 0 && (variance > 0 || time > 0);
    };
    one.pareto = std::none_of(contenders.begin(), contenders.end(), beats);
  }
}

std::optional<std::size_t> best_unbiased(const std::vector<Contender>& contenders) {
  std::optional<std::size_t> best;
  const auto price = [&](std::size_t i) { return contenders[i].cost->variance_x_ns->value; };
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    if (!claims_unbiased(contender) || !contender.cost || !contender.cost->variance_x_ns || !(price(i) > 0)) continue;
    if (!best || price(i) < price(*best)) best = i;
  }
  return best;
}

bool is_named(const Contender& contender, const std::string& name) {
  return contender.record->cell.estimator.type == name || tracker_label(contender.record->cell) == name ||
         contender.label == name;
}

/// Why two cells are not of the same random streams, or their errors on them not known; empty where they are.
const char* unlike(const CellRecord& a, const CellRecord& b) {
  if (a.cell.own_streams || b.cell.own_streams) return "draws from streams of its own";
  if (a.cell.seed != b.cell.seed) return "has another seed";
  if (a.rays != b.rays) return "has another number of rays";
  if (a.cell.samples_per_ray != b.cell.samples_per_ray) return "has another number of samples";
  if (a.cell.precision != b.cell.precision) return "has another precision";
  for (const CellRecord* one : {&a, &b})
    if (one->squared_error_blocks.size() != BlockErrors::kBlocks) return "has too few samples for an interval";
  return "";
}

/// Squared errors that are no more than rounding, whose ratio tells nothing.
bool only_rounding(const CellRecord& record, Real total) {
  const std::optional<Cost> cost = cost_of(record);
  const Real rounding = cost ? kRounding * cost->reference : 0;
  return total / static_cast<Real>(BlockErrors::kBlocks) <= rounding * rounding;
}

/// Variance of log(statistic) by leaving out one block after the other [Tukey 1958].
template <class Statistic>
Real jackknife_variance(const Statistic& log_without) {
  constexpr auto kBlocks = static_cast<Real>(BlockErrors::kBlocks);
  std::array<Real, BlockErrors::kBlocks> each;
  for (std::size_t b = 0; b < each.size(); ++b) each[b] = log_without(b);
  const Real mean = std::accumulate(each.begin(), each.end(), Real{0}) / kBlocks;
  Real sum = 0;
  for (const Real x : each) sum += (x - mean) * (x - mean);
  return sum * (kBlocks - 1) / kBlocks;
}

std::optional<Interval> ratio_of_means(const std::optional<Cost>& a, const std::optional<Cost>& b, std::uint64_t samples) {
  if (!a || !b || !(a->floor || b->floor)) return std::nullopt;
  const Interval below = mean_square_error(*b, samples);
  return below.value > 0 ? std::optional(quotient(mean_square_error(*a, samples), below)) : std::nullopt;
}

void pair_up(Contest& contest, std::size_t one, std::size_t other) {
  const Contender &first = contest.contenders[one], &second = contest.contenders[other];
  const CellRecord &a = *first.record, &b = *second.record;
  if (const std::string reason = unlike(a, b); !reason.empty()) {
    contest.unpaired.push_back({one, reason});
    return;
  }
  const auto total = [](const CellRecord& record) {
    return std::accumulate(record.squared_error_blocks.begin(), record.squared_error_blocks.end(), Real{0});
  };
  const Real of_a = total(a), of_b = total(b);
  if (only_rounding(a, of_a) || only_rounding(b, of_b)) {
    contest.unpaired.push_back({one, "is exact but for rounding, or its baseline is"});
    return;
  }
  const auto log_without = [&](const CellRecord& record, Real all) {
    return [&record, all](std::size_t block) { return std::log(all - record.squared_error_blocks[block]); };
  };
  const auto log_a = log_without(a, of_a), log_b = log_without(b, of_b);
  const Real paired = jackknife_variance([&](std::size_t block) { return log_a(block) - log_b(block); });
  const Real alone = jackknife_variance(log_a) + jackknife_variance(log_b);
  if (!std::isfinite(paired) || !std::isfinite(alone)) {
    contest.unpaired.push_back({one, "has all its error in one of the 16 parts, which leaves no interval"});
    return;
  }
  static const Real kStudent = boost::math::quantile(boost::math::students_t(BlockErrors::kBlocks - 1), 0.975) / kNormal975;
  contest.pairings.push_back({one, other, relative(of_a / of_b, kStudent * std::sqrt(paired)),
                              relative(of_a / of_b, kStudent * std::sqrt(alone)), a.cell.samples_per_ray,
                              ratio_of_means(first.cost, second.cost, a.cell.samples_per_ray)});
}

void decide(Contest& contest, const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::vector<Contender>& contenders = contest.contenders;
  rank(contenders);
  tell_apart(contenders, runs);
  mark_pareto(contenders);
  contest.best_unbiased = best_unbiased(contenders);
  const auto base = std::find_if(contenders.begin(), contenders.end(), [&](const Contender& contender) {
    return baseline.empty() ? claims_unbiased(contender) : is_named(contender, baseline);
  });
  if (base != contenders.end()) contest.baseline = static_cast<std::size_t>(base - contenders.begin());
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    Contender& contender = contenders[i];
    if (contender.cost && contender.cost->floor && contest.best_unbiased)
      contender.break_even = break_even(*contender.cost, *contenders[*contest.best_unbiased].cost);
    if (!contest.baseline) continue;
    if (has_time(contender) && has_time(*base))
      contender.relative = i == *contest.baseline ? exactly(1) : quotient(*contender.seconds[0], *base->seconds[0]);
    if (i != *contest.baseline) pair_up(contest, i, *contest.baseline);
  }
}

}  // namespace

std::vector<Contest> contests(const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::vector<Contest> all;
  std::map<std::string, std::size_t> places;
  std::vector<std::string> known;
  std::set<std::string> types;
  for (std::size_t run = 0; run < runs.size(); ++run)
    for (const CellRecord& record : runs[run].cells) {
      if (record.status != Status::ok || !record.outputs.empty()) continue;
      Contest contest = empty_contest(record);
      const auto [place, fresh] = places.try_emplace(contest.name, all.size());
      if (fresh) all.push_back(std::move(contest));
      Contender contender;
      contender.run = run;
      contender.record = &record;
      contender.label = tracker_label(record.cell);
      contender.cost = cost_of(record);
      for (const Real target : kTargets) {
        contender.seconds.push_back(contender.cost ? seconds_to(*contender.cost, target) : std::nullopt);
        contender.amortised.push_back(contender.cost && is_amortised(*contender.cost, target));
      }
      known.insert(known.end(), {contender.label, record.cell.estimator.type});
      types.insert(record.cell.estimator.type);
      all[place->second].contenders.push_back(std::move(contender));
    }
  for (Contest& contest : all) decide(contest, runs, baseline);
  const auto has_baseline = [](const Contest& contest) { return contest.baseline.has_value(); };
  if (!baseline.empty() && std::none_of(all.begin(), all.end(), has_baseline)) {
    const std::string near = nearest(baseline, known);
    throw InputError(fmt::format(
        "--baseline: no cell of the results has the estimator \"{}\"{}", baseline,
        near.empty() ? fmt::format("; they have {}", fmt::join(types, ", ")) : fmt::format("; did you mean \"{}\"?", near)));
  }
  return all;
}

}  // namespace nullmark
