#include "harness/performance_gate/wall_time.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <regex>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/results_json.h"

namespace nullmark {
namespace {

constexpr Real kOwnThreshold = 0.05, kFalseDiscoveries = 0.05, kConfidence = 0.95;

/// ns of one step of the floor loop in the process that a run was; nothing where the run has no cell that looks up.
std::optional<Real> floor_of(const RunRecord& run) {
  for (const CellRecord& record : run.cells)
    if (record.time && record.time->floor_ratio > 0 && record.time->ns_per_lookup > 0)
      return record.time->ns_per_lookup / record.time->floor_ratio;
  return std::nullopt;
}

/// Time of one sample by cell, in steps of the floor loop (in ns where the run has no floor).
std::map<std::string, Real> times(const RunRecord& run) {
  const Real unit = floor_of(run).value_or(1);
  std::map<std::string, Real> result;
  for (const CellRecord& record : run.cells)
    if (record.time && record.time->ns_per_sample > 0) result[record.cell.name] = record.time->ns_per_sample / unit;
  return result;
}

/// By cell, one entry a block: log of the second side's time over the first's.
std::map<std::string, std::vector<Real>> log_ratios(const std::vector<TimedBlock>& blocks,
                                                    std::array<RunRecord, 2> TimedBlock::*second) {
  std::map<std::string, std::vector<Real>> result;
  for (const TimedBlock& block : blocks) {
    std::map<std::string, Real> sums;
    std::map<std::string, int> terms;
    const auto add = [&](const RunRecord& run, Real weight) {
      for (const auto& [cell, time] : times(run)) {
        sums[cell] += weight * std::log(time);
        ++terms[cell];
      }
    };
    for (const RunRecord& run : block.*second) add(run, 0.5);
    for (const RunRecord& run : block.before) add(run, -0.5);
    for (const auto& [cell, sum] : sums)
      if (terms[cell] == 4) result[cell].push_back(sum);
  }
  return result;
}

/// Indices of the hypotheses that Benjamini and Hochberg [1995] reject.
std::vector<bool> discoveries(const std::vector<Real>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::size_t rejected = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (p[order[k]] <= kFalseDiscoveries * static_cast<Real>(k + 1) / static_cast<Real>(p.size())) rejected = k + 1;
  std::vector<bool> result(p.size(), false);
  for (std::size_t k = 0; k < rejected; ++k) result[order[k]] = true;
  return result;
}

std::vector<GateRow> judge(const std::map<std::string, std::vector<Real>>& cells, Real threshold) {
  using boost::math::cdf;
  using boost::math::complement;
  using boost::math::quantile;
  std::vector<GateRow> rows;
  std::vector<Real> p;  // of "not slower than the threshold", then of "not faster", cell by cell
  const Real margin = std::log1p(threshold);
  for (const auto& [cell, ratios] : cells) {
    if (ratios.size() < kLeastBlocks) continue;
    const auto n = static_cast<Real>(ratios.size());
    const Real mean = std::accumulate(ratios.begin(), ratios.end(), Real{0}) / n;
    Real squares = 0;
    for (const Real x : ratios) squares += (x - mean) * (x - mean);
    // Equal to the last bit in every block is what copies of one file look like.
    const Real error = std::max(std::sqrt(squares / (n - 1) / n), std::numeric_limits<Real>::min());
    const boost::math::students_t law(n - 1);
    const Real half = error * quantile(complement(law, (1 - kConfidence) / 2));
    rows.push_back({cell,
                    Tier::wall_time,
                    "time over the floor loop's",
                    GateResult::same,
                    {},
                    {},
                    std::expm1(mean),
                    std::expm1(mean - half),
                    std::expm1(mean + half),
                    threshold,
                    fmt::format("{:g} %, {} blocks", 100 * kConfidence, ratios.size()),
                    ""});
    const auto beyond = [&](Real distance) {
      const Real t = distance / error;
      return std::isfinite(t) ? cdf(complement(law, t)) : distance > 0 ? 0 : 1;
    };
    p.push_back(beyond(mean - margin));
    p.push_back(beyond(-mean - margin));
  }
  const std::vector<bool> found = discoveries(p);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Real low = std::log1p(*rows[i].low), high = std::log1p(*rows[i].high);
    if (low < -margin || high > margin) rows[i].finding = GateResult::undecided;
    if (found[2 * i] && low > margin) rows[i].finding = GateResult::slower;
    if (found[2 * i + 1] && high < -margin) rows[i].finding = GateResult::better;
  }
  return rows;
}

}  // namespace

std::vector<TimedBlock> read_blocks(const std::string& folder) {
  if (!std::filesystem::is_directory(folder))
    throw InputError(folder + ": is no folder; expected the blocks that scripts/compare-builds leaves");
  const std::regex pattern("([0-9]+)\\.(old|new|control)\\.([12])\\.json");
  std::map<std::string, std::map<std::string, std::string>> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    std::smatch parts;
    if (std::regex_match(name, parts, pattern))
      found[parts[1]][fmt::format("{}.{}", parts[2].str(), parts[3].str())] = entry.path().string();
  }
  if (found.size() < kLeastBlocks)
    throw InputError(fmt::format("{}: found {} blocks; expected at least {}, as scripts/compare-builds leaves them", folder,
                                 found.size(), kLeastBlocks));
  std::vector<TimedBlock> blocks;
  for (const auto& [number, files] : found) {
    TimedBlock block;
    for (const auto& [side, runs] :
         {std::pair{"old", &TimedBlock::before}, {"new", &TimedBlock::after}, {"control", &TimedBlock::control}})
      for (std::size_t i = 0; i < 2; ++i) {
        const std::string part = fmt::format("{}.{}", side, i + 1);
        const auto at = files.find(part);
        if (at == files.end())
          throw InputError(
              fmt::format("{}: block {} has no {}.{}.json; remove the block or repeat it", folder, number, number, part));
        (block.*runs)[i] = read_results(read_file(at->second), at->second);
      }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

std::vector<GateRow> compare_wall_time(const std::vector<TimedBlock>& blocks, std::optional<Real> threshold, bool quiet) {
  const Real margin = threshold.value_or(kOwnThreshold);
  std::vector<GateRow> rows = judge(log_ratios(blocks, &TimedBlock::after), margin);
  std::string told;
  for (const GateRow& control : judge(log_ratios(blocks, &TimedBlock::control), margin))
    if ((control.finding == GateResult::slower || control.finding == GateResult::better) && told.empty())
      told = fmt::format("the control, a program against itself, shows {:+.1f} % in {}", 100 * *control.change, control.cell);
  for (GateRow& row : rows) {
    if (!told.empty()) {
      row.finding = GateResult::noisy;
      row.note = told;
    } else if (row.finding == GateResult::slower && quiet) {
      row.finding = GateResult::regression;
    }
  }
  return rows;
}

}  // namespace nullmark
