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
#include <tuple>

#include "harness/config/cell_names.h"
#include "harness/io/json_input.h"
#include "harness/io/transport_json.h"
#include "harness/model/names.h"
#include "harness/statistics/moments.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

std::string measurement_label(const Measurement& measurement) {
  std::string label = measurement.clamp ? "clamped" : "";
  if (measurement.quantise_bits > 0) label += fmt::format("{}{} bits", label.empty() ? "" : ", ", measurement.quantise_bits);
  return label;
}

Comparison empty_comparison(const CellRecord& record) {
  Comparison comparison;
  comparison.quantity = to_string(record.cell.quantity);
  comparison.medium = record.medium->label;
  comparison.majorant = record.majorant->label;
  comparison.rays = record.ray_set->label;
  comparison.light = transport_label(record.cell.transport);
  comparison.measurement = measurement_label(record.cell.measurement);
  comparison.build = record.build;
  comparison.name =
      fmt::format("{} | {} | {} | {}", comparison.quantity, comparison.medium, comparison.majorant, comparison.rays);
  for (const std::string* part : {&comparison.light, &comparison.measurement, &comparison.build})
    if (!part->empty()) comparison.name += " | " + *part;
  return comparison;
}

/// Trackers that stand twice in a comparison are told apart by the first of these that differs among them.
void tell_apart(std::vector<RankedCell>& cells, const std::vector<RunRecord>& runs) {
  std::map<std::string, std::vector<RankedCell*>> same;
  for (RankedCell& ranked : cells) same[ranked.label].push_back(&ranked);
  const auto traits = [&](const RankedCell& ranked) {
    const Cell& cell = ranked.record->cell;
    return std::array{fmt::format("seed:{}", cell.seed),
                      fmt::format("samples:{}", cell.samples_per_ray),
                      cell.experiment,
                      std::string(cell.own_streams ? "own streams" : "common streams"),
                      runs[ranked.run].name,
                      fmt::format("file {}", ranked.run + 1)};
  };
  for (auto& [label, those] : same) {
    if (those.size() == 1) continue;
    std::set<std::string> labels;
    for (std::size_t trait = 0; labels.size() < those.size() && trait < traits(*those[0]).size(); ++trait) {
      std::set<std::string> values;
      for (const RankedCell* ranked : those) values.insert(traits(*ranked)[trait]);
      if (values.size() == 1) continue;
      labels.clear();
      for (RankedCell* ranked : those) labels.insert(ranked->label += "/" + traits(*ranked)[trait]);
    }
  }
}

/// Reachable in a known time.
bool has_time(const RankedCell& ranked) { return ranked.seconds[0] && std::isfinite(ranked.seconds[0]->value); }

/// Exact trackers are no rivals: they draw nothing.
bool is_unbiased_estimator(const RankedCell& ranked) {
  return ranked.record->claims == "unbiased" && stands_unbiased(*ranked.record);
}

/// Several results of one tracker are no rivals: the times of single runs have no verdict, and other samples make no other
/// tracker.
bool are_rivals(const RankedCell& a, const RankedCell& b) { return a.tracker != b.tracker; }

/// How many other trackers are better than a cell in all of their results that count.
template <class Counts, class IsBetter>
std::size_t better_in_all_results(const std::vector<RankedCell>& cells, const RankedCell& than, const Counts& counts,
                                  const IsBetter& is_better) {
  std::map<std::string, bool> better;
  for (const RankedCell& other : cells) {
    if (!counts(other) || !are_rivals(other, than)) continue;
    bool& all = better.try_emplace(other.tracker, true).first->second;
    all = all && is_better(other);
  }
  return static_cast<std::size_t>(std::count_if(better.begin(), better.end(), [](const auto& one) { return one.second; }));
}

void rank(std::vector<RankedCell>& cells) {
  const auto key = [](const RankedCell& ranked) { return has_time(ranked) ? ranked.seconds[0]->value : kInfinity; };
  std::stable_sort(cells.begin(), cells.end(), [&](const RankedCell& a, const RankedCell& b) { return key(a) < key(b); });
  for (RankedCell& ranked : cells)
    if (has_time(ranked))
      ranked.rank = 1 + better_in_all_results(cells, ranked, has_time, [&](const RankedCell& other) {
                      return quotient(*ranked.seconds[0], *other.seconds[0]).low > 1;
                    });
  const auto place = [](const RankedCell& ranked) { return ranked.rank.value_or(std::numeric_limits<std::size_t>::max()); };
  std::stable_sort(cells.begin(), cells.end(), [&](const RankedCell& a, const RankedCell& b) { return place(a) < place(b); });
  const auto any_other = [&](const auto& fits) { return std::any_of(cells.begin(), cells.end(), fits); };
  for (RankedCell& ranked : cells) {
    if (!ranked.rank) continue;
    ranked.tied = any_other([&](const RankedCell& other) { return are_rivals(other, ranked) && other.rank == ranked.rank; });
    ranked.split = any_other(
        [&](const RankedCell& other) { return !are_rivals(other, ranked) && other.seconds[0] && other.rank != ranked.rank; });
  }
}

void mark_pareto(std::vector<RankedCell>& cells) {
  const auto is_known = [](const RankedCell& ranked) { return ranked.cost && ranked.cost->ns_per_sample; };
  for (RankedCell& one : cells) {
    if (!is_known(one)) continue;
    const auto beats = [&](const RankedCell& other) {
      const Real variance = one.cost->variance.value - other.cost->variance.value;
      const Real time = one.cost->ns_per_sample->value - other.cost->ns_per_sample->value;
      return variance >= 0 && time >= 0 && (variance > 0 || time > 0);
    };
    one.pareto = better_in_all_results(cells, one, is_known, beats) == 0;
  }
}

std::optional<std::size_t> best_unbiased(const std::vector<RankedCell>& cells) {
  std::optional<std::size_t> best;
  const auto price = [&](std::size_t i) { return cells[i].cost->variance_x_ns->value; };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const RankedCell& ranked = cells[i];
    if (!is_unbiased_estimator(ranked) || !ranked.cost || !ranked.cost->variance_x_ns || !(price(i) > 0)) continue;
    if (!best || price(i) < price(*best)) best = i;
  }
  return best;
}

bool is_named(const RankedCell& ranked, const std::string& name) {
  return ranked.record->cell.estimator->type == name || tracker_label(ranked.record->cell) == name || ranked.label == name;
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

void pair_up(Comparison& comparison, std::size_t one, std::size_t other) {
  const RankedCell &first = comparison.cells[one], &second = comparison.cells[other];
  const CellRecord &a = *first.record, &b = *second.record;
  if (const std::string reason = unlike(a, b); !reason.empty()) {
    comparison.unpaired.push_back({one, reason});
    return;
  }
  const auto total = [](const CellRecord& record) {
    return std::accumulate(record.squared_error_blocks.begin(), record.squared_error_blocks.end(), Real{0});
  };
  const Real of_a = total(a), of_b = total(b);
  if (only_rounding(a, of_a) || only_rounding(b, of_b)) {
    comparison.unpaired.push_back({one, "is exact but for rounding, or its baseline is"});
    return;
  }
  const auto log_without = [&](const CellRecord& record, Real all) {
    return [&record, all](std::size_t block) { return std::log(all - record.squared_error_blocks[block]); };
  };
  const auto log_a = log_without(a, of_a), log_b = log_without(b, of_b);
  const Real paired = jackknife_variance([&](std::size_t block) { return log_a(block) - log_b(block); });
  const Real alone = jackknife_variance(log_a) + jackknife_variance(log_b);
  if (!std::isfinite(paired) || !std::isfinite(alone)) {
    comparison.unpaired.push_back({one, "has all its error in one of the 16 parts, which leaves no interval"});
    return;
  }
  static const Real kStudent = boost::math::quantile(boost::math::students_t(BlockErrors::kBlocks - 1), 0.975) / kNormal975;
  comparison.pairings.push_back({one, other, relative(of_a / of_b, kStudent * std::sqrt(paired)),
                                 relative(of_a / of_b, kStudent * std::sqrt(alone)), a.cell.samples_per_ray,
                                 ratio_of_means(first.cost, second.cost, a.cell.samples_per_ray)});
}

/// What the walks gave, where they drew random numbers at all.
auto drawn(const CellRecord& record) {
  std::vector<std::optional<Real>> figures;
  for (const ChannelRecord& channel : record.channel)
    figures.insert(figures.end(), {channel.mean, channel.variance, channel.rmse});
  return std::tuple(record.samples, record.draws, record.lookups, record.squared_error_blocks, figures);
}

void remark(Comparison& comparison) {
  const std::vector<RankedCell>& cells = comparison.cells;
  std::map<decltype(drawn(*cells[0].record)), std::vector<std::size_t>> alike;
  Remark lanes{Remark::Kind::lanes, {}};
  bool one_walk = false;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellRecord& record = *cells[i].record;
    if (record.draws > 0 && record.samples > 1) alike[drawn(record)].push_back(i);
    if (!record.time) continue;
    one_walk |= !record.in_lanes;
    if (record.in_lanes) lanes.cells.push_back(i);
  }
  for (auto& [figures, those] : alike)
    if (those.size() > 1) comparison.remarks.push_back({Remark::Kind::equal, those});
  if (one_walk && !lanes.cells.empty()) comparison.remarks.push_back(lanes);
}

Real possible_bias(const RankedCell& ranked) {
  // A floor is in the times already.
  if (ranked.cost && ranked.cost->floor) return 0;
  const CellRecord& record = *ranked.record;
  return kind_of(record) == Kind::pass && record.verdict->unbiased == Outcome::pass ? excluded_bias(*record.verdict) : kInfinity;
}

void decide(Comparison& comparison, const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::vector<RankedCell>& cells = comparison.cells;
  rank(cells);
  tell_apart(cells, runs);
  mark_pareto(cells);
  remark(comparison);
  comparison.best_unbiased = best_unbiased(cells);
  const auto base = std::find_if(cells.begin(), cells.end(), [&](const RankedCell& ranked) {
    return baseline.empty() ? is_unbiased_estimator(ranked) : is_named(ranked, baseline);
  });
  if (base != cells.end()) comparison.baseline = static_cast<std::size_t>(base - cells.begin());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    RankedCell& ranked = cells[i];
    if (ranked.cost && ranked.cost->floor && comparison.best_unbiased)
      ranked.break_even = break_even(*ranked.cost, *cells[*comparison.best_unbiased].cost);
    if (!comparison.baseline) continue;
    if (i == *comparison.baseline && has_time(ranked)) ranked.relative = exactly(1);
    if (are_rivals(ranked, *base) && has_time(ranked) && has_time(*base))
      ranked.relative = quotient(*ranked.seconds[0], *base->seconds[0]);
    if (i != *comparison.baseline) pair_up(comparison, i, *comparison.baseline);
  }
}

}  // namespace

std::vector<std::size_t> fastest(const Comparison& comparison, bool unbiased) {
  std::vector<std::size_t> places;
  std::optional<std::size_t> best = unbiased ? std::nullopt : std::optional<std::size_t>(1);
  for (std::size_t i = 0; i < comparison.cells.size(); ++i) {
    const RankedCell& ranked = comparison.cells[i];
    if (!ranked.rank || (unbiased && !stands_unbiased(*ranked.record))) continue;
    // Cells are in the order of their ranks.
    if (!best) best = ranked.rank;
    if (ranked.rank == best) places.push_back(i);
  }
  return places;
}

bool is_proven_to_reach(const RankedCell& ranked, Real error) {
  constexpr Real kSlack = 1e-9;  // epsilon was multiplied by the mean, and is divided by it again
  return ranked.possible_bias <= error * (1 + kSlack);
}

bool break_even_is_unproven(const Comparison& comparison, const RankedCell& ranked) {
  return ranked.break_even && ranked.break_even->kind == BreakEven::Kind::at && comparison.best_unbiased &&
         !is_proven_to_reach(comparison.cells[*comparison.best_unbiased], ranked.break_even->error.value);
}

std::string unproven_note(const Comparison& comparison) {
  Real least = kInfinity, most = 0;
  bool some = false, unexcluded = false;
  for (std::size_t i = 0; i < comparison.cells.size(); ++i) {
    const RankedCell& ranked = comparison.cells[i];
    bool marked = false;
    for (std::size_t target = 0; target < std::size(kTargets); ++target)
      marked |=
          ranked.seconds[target] && std::isfinite(ranked.seconds[target]->value) && !is_proven_to_reach(ranked, kTargets[target]);
    if (i == comparison.best_unbiased)
      marked |= std::any_of(comparison.cells.begin(), comparison.cells.end(),
                            [&](const RankedCell& other) { return break_even_is_unproven(comparison, other); });
    if (!marked) continue;
    if (!std::isfinite(ranked.possible_bias)) {
      unexcluded = true;
      continue;
    }
    some = true;
    least = std::min(least, ranked.possible_bias);
    most = std::max(most, ranked.possible_bias);
  }
  if (!some) return unexcluded ? "this error may not be reached: without a PASS no bias is ruled out" : "";
  const std::string from = fmt::format("{:.2g}", 100 * least), to = fmt::format("{:.2g}", 100 * most);
  return fmt::format("this error may not be reached: a PASS rules out only a bias above {} % of the mean{}",
                     from == to ? to : fmt::format("{} to {}", from, to),
                     unexcluded ? ", and without a PASS none is ruled out" : "");
}

std::vector<Comparison> comparisons(const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::vector<Comparison> all;
  std::map<std::string, std::size_t> places;
  std::vector<std::string> known;
  std::set<std::string> types;
  for (std::size_t run = 0; run < runs.size(); ++run)
    for (const CellRecord& record : runs[run].cells) {
      if (record.status != Status::ok || !record.outputs.empty() || record.cell.minus) continue;
      Comparison comparison = empty_comparison(record);
      const auto [place, fresh] = places.try_emplace(comparison.name, all.size());
      if (fresh) all.push_back(std::move(comparison));
      RankedCell ranked;
      ranked.run = run;
      ranked.record = &record;
      ranked.tracker = ranked.label = tracker_label(record.cell);
      ranked.cost = cost_of(record);
      for (const Real target : kTargets) {
        ranked.seconds.push_back(ranked.cost ? seconds_to(*ranked.cost, target) : std::nullopt);
        ranked.amortised.push_back(ranked.cost && is_amortised(*ranked.cost, target));
      }
      ranked.possible_bias = possible_bias(ranked);
      known.insert(known.end(), {ranked.label, record.cell.estimator->type});
      types.insert(record.cell.estimator->type);
      all[place->second].cells.push_back(std::move(ranked));
    }
  for (Comparison& comparison : all) decide(comparison, runs, baseline);
  const auto has_baseline = [](const Comparison& comparison) { return comparison.baseline.has_value(); };
  if (!baseline.empty() && std::none_of(all.begin(), all.end(), has_baseline)) {
    const std::string near = nearest(baseline, known);
    throw InputError(fmt::format(
        "--baseline: no cell of the results has the estimator \"{}\"{}", baseline,
        near.empty() ? fmt::format("; they have {}", fmt::join(types, ", ")) : fmt::format("; did you mean \"{}\"?", near)));
  }
  return all;
}

}  // namespace nullmark
