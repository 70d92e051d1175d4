#include "harness/run/deal.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "harness/registry/components.h"
#include "harness/run/demand.h"
#include "harness/sampling/cell_theory.h"
#include "harness/sampling/failure.h"
#include "harness/sampling/test_families.h"

namespace nullmark {
namespace {

/// Of large pictures so many rays stand for all.
constexpr std::size_t kDealtRays = 16;

/// Nanoseconds of a sample, and for each of its lookups; of a light path for each of its random numbers.  What they are on one
/// machine; only their ratios matter.
struct Rates {
  double sample, each;
};
constexpr Rates kInLanes{20, 6.5}, kInLanesLocal{40, 6.5}, kAlone{100, 11}, kLight{80, 30}, kLightLocal{80, 42};
/// Of theory, for a ray and for a point that it looks at; of preparing a cell.
constexpr double kTheoryOfRay = 5e3, kTheoryOfPoint = 40, kOfCell = 1e6;

/// Of one sample, by the counts of some.
double sample_cost(const PreparedCell& prepared, const Counters& counts) {
  const bool local = prepared.scene->majorant->structure->size().cells > 1;
  const auto samples = static_cast<double>(std::max<std::uint64_t>(1, counts.samples));
  if (prepared.cell->quantity == Quantity::radiance) {
    const Rates& rates = local ? kLightLocal : kLight;
    return rates.sample + rates.each * static_cast<double>(counts.draws) / samples;
  }
  const Rates& rates = !prepared.kernel->in_lanes(prepared.cell->quantity) ? kAlone : local ? kInLanesLocal : kInLanes;
  return rates.sample + rates.each * static_cast<double>(counts.lookups) / samples;
}

double timing_cost(const TimingPlan& timing) {
  constexpr double kNanoseconds = 1e9;
  return timing.enabled
             ? timing.repetitions * timing.seconds * kNanoseconds * static_cast<double>(timing.samples_per_traversal.size())
             : 0;
}

CellCost cost_of(const PreparedCell& prepared, const TestLevels& levels, std::uint64_t rays) {
  const auto all = static_cast<double>(rays);
  const double stands_for = all / static_cast<double>(std::max<std::size_t>(1, prepared.scene->rays->world.size()));
  const Demand demand(prepared, levels, stands_for);
  const double of_each = sample_cost(prepared, demand.probe) * static_cast<double>(prepared.scene->rays->world.size());
  const double theory = all * (kTheoryOfRay + kTheoryOfPoint * prepared.theory.work);
  CellCost cost;
  cost.spread = of_each * demand.samples;
  cost.each = kOfCell + of_each * demand.pilot;
  cost.once = of_each * demand.laws;
  (needs_theory(prepared) ? cost.each : cost.once) += theory;
  const auto per_ray = static_cast<std::uint64_t>(demand.samples / stands_for);
  cost.portions = SpanCut(static_cast<std::size_t>(rays), {.per_ray = std::max<std::uint64_t>(1, per_ray)}).portions();
  return cost;
}

/// Parts of a cell: small ones, so that errors of the forecast even out, where what each part does for itself is little beside
/// its samples; large ones otherwise.
std::size_t parts_of(const CellCost& cost, double mean, std::size_t shards) {
  constexpr double kSmall = 1. / 64, kLarge = 1. / 8, kLittle = 0.05, kLeast = 1e7;
  const double small = cost.spread / (kSmall * mean), large = cost.spread / (kLarge * mean);
  const double cheap = kLittle * cost.spread / std::max(cost.each, 1.);
  const auto possible = static_cast<double>(std::min(shards, cost.portions));
  const double most = std::max(1., std::min(possible, std::floor(cost.spread / kLeast)));
  return static_cast<std::size_t>(std::clamp(std::ceil(std::max(large, std::min(small, cheap))), 1., most));
}

}  // namespace

std::vector<bool> Deal::cells_of(std::size_t shard) const {
  std::vector<bool> cells(shard_of.size());
  for (std::size_t i = 0; i < cells.size(); ++i)
    cells[i] = std::find(shard_of[i].begin(), shard_of[i].end(), shard) != shard_of[i].end();
  return cells;
}

std::vector<CellShare> Deal::shares_of(std::size_t shard) const {
  std::vector<CellShare> shares(shard_of.size());
  for (std::size_t i = 0; i < shares.size(); ++i)
    if (const auto at = std::find(shard_of[i].begin(), shard_of[i].end(), shard); at != shard_of[i].end())
      shares[i] = {static_cast<std::size_t>(at - shard_of[i].begin()), shard_of[i].size()};
  return shares;
}

std::size_t Deal::split_cells() const {
  return static_cast<std::size_t>(
      std::count_if(shard_of.begin(), shard_of.end(), [](const auto& parts) { return parts.size() > 1; }));
}

Deal deal_costs(const std::vector<std::optional<CellCost>>& costs, std::size_t shards) {
  double total = 0;
  for (const auto& cost : costs)
    if (cost) total += cost->spread + cost->each + cost->once;
  const double mean = total / static_cast<double>(shards);
  std::vector<std::tuple<double, std::size_t, std::size_t>> parts;  // cost, cell, part
  Deal deal;
  deal.shard_of.resize(costs.size());
  deal.loads.resize(shards);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    if (!costs[i]) continue;
    const CellCost& cost = *costs[i];
    const std::size_t count = parts_of(cost, mean, shards);
    deal.shard_of[i].resize(count);
    for (std::size_t part = 0; part < count; ++part) {
      const double portions =
          static_cast<double>((cost.portions + count - 1 - part) / count) / static_cast<double>(cost.portions);
      parts.emplace_back(cost.spread * portions + cost.each + (part == 0 ? cost.once : 0), i, part);
    }
  }
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return std::get<0>(a) > std::get<0>(b); });
  // The dearest first, each to the shard that has least and no part of the cell.
  std::vector<std::vector<bool>> taken(costs.size());
  for (const auto& [cost, cell, part] : parts) {
    taken[cell].resize(shards);
    std::size_t best = shards;
    for (std::size_t shard = 0; shard < shards; ++shard)
      if (!taken[cell][shard] && (best == shards || deal.loads[shard] < deal.loads[best])) best = shard;
    taken[cell][best] = true;
    deal.shard_of[cell][part] = best;
    deal.loads[best] += cost;
  }
  return deal;
}

Deal deal(const Plan& plan, const std::vector<bool>& wanted, std::size_t shards) {
  const TestLevels levels{plan.error_rates.alpha_pass, mean_family(plan)};
  std::vector<std::optional<CellCost>> costs(plan.cells.size());
  CellPreparer preparer(plan, kDealtRays);
  std::vector<PreparedCell> cells;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    if (!wanted[i]) continue;
    costs[i].emplace();
    costs[i]->once = timing_cost(plan.timing);
    // A tracker from outside is started by the shard that runs its cell.
    if (!is_from_outside(plan.cells[i])) cells.push_back(preparer.prepare(i));
  }
  add_theory(cells);
  for (const PreparedCell& prepared : cells) {
    if (!prepared.reason.empty()) continue;
    const std::uint64_t rays = make_ray_set(*plan.ray_sets[prepared.cell->rays])->count();
    CellCost cost;
    // What a tracker throws is told by the shard that runs its cell.
    const std::string failure = failure_of<ParameterError, std::bad_alloc>([&] { cost = cost_of(prepared, levels, rays); });
    if (!failure.empty()) continue;
    cost.once += costs[prepared.index]->once;
    costs[prepared.index] = cost;
  }
  return deal_costs(costs, shards);
}

}  // namespace nullmark
