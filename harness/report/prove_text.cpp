#include "harness/report/prove_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/io/text.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

/// Biases that PASSes exclude.
struct Excluded {
  Real least = kInfinity, most = 0;

  void add(Real bias) {
    least = std::min(least, bias);
    most = std::max(most, bias);
  }

  std::string text() const {
    const auto percent = [](Real x) { return x < 1e-6 ? std::string("rounding") : fmt::format("{:.2g} %", 100 * x); };
    return percent(least) == percent(most) ? percent(most) : fmt::format("{} to {}", percent(least), percent(most));
  }
};

struct Part {
  std::size_t cells = 0, pass = 0, fail = 0, errors = 0, open = 0, violated = 0, other = 0;
  Excluded of_means, of_groups;  ///< of the mean over all rays, and over groups of them

  void add(const CellRecord& record) {
    ++cells;
    const Kind kind = kind_of(record);
    pass += kind == Kind::pass;
    fail += kind == Kind::fail;
    errors += kind == Kind::error;
    open += kind == Kind::expected_open || kind == Kind::unexpected_open;
    violated += kind == Kind::violated;
    other += kind == Kind::untested || kind == Kind::not_run;
    if (kind != Kind::pass) return;
    of_means.add(excluded_bias(*record.verdict));
    if (const Real bias = excluded_bias_of_groups(*record.verdict); bias > 0) of_groups.add(bias);
  }

  std::string bias_text() const {
    if (pass == 0) return "-";
    return of_means.text() + (of_groups.most > 0 ? "; of groups of rays " + of_groups.text() : "");
  }
};

}  // namespace

std::string scenes_text(const RunRecord& run) {
  std::vector<std::pair<std::string, Part>> parts;
  for (const CellRecord& record : run.cells) {
    if (parts.empty() || parts.back().first != record.cell.experiment) parts.emplace_back(record.cell.experiment, Part());
    parts.back().second.add(record);
  }
  std::vector<std::vector<std::string>> lines = {
      {"scenes", "cells", "PASS", "FAIL", "ERROR", "undecided", "VIOLATED", "not tested", "|bias| excluded"}};
  for (const auto& [name, part] : parts)
    lines.push_back({name, fmt::to_string(part.cells), fmt::to_string(part.pass), fmt::to_string(part.fail),
                     fmt::to_string(part.errors), fmt::to_string(part.open), fmt::to_string(part.violated),
                     fmt::to_string(part.other), part.bias_text()});
  return aligned(lines, 1);
}

std::string findings_text(const RunRecord& run) {
  enum class Sort { failed, open, untested };
  const auto sort_of = [](Kind kind) {
    if (kind == Kind::fail || kind == Kind::error || kind == Kind::violated) return Sort::failed;
    return kind == Kind::unexpected_open || kind == Kind::expected_open ? Sort::open : Sort::untested;
  };
  struct Found {
    const CellRecord* first = nullptr;
    std::size_t count = 0;
  };
  std::map<std::pair<Sort, std::string>, Found> found;
  for (const CellRecord& record : run.cells) {
    const Kind kind = kind_of(record);
    if (kind == Kind::pass) continue;
    // Time runs out for all of them alike.
    const Sort sort = sort_of(kind);
    Found& part = found[{sort, sort == Sort::untested ? reason_of(record) : record.cell.experiment}];
    if (part.count++ == 0) part.first = &record;
  }
  std::string text;
  for (const auto& [key, part] : found)
    text += fmt::format("{}: {}{}\n  {}\n", key.first == Sort::untested ? "not tested" : verdict_word(kind_of(*part.first)),
                        part.first->cell.name,
                        part.count > 1
                            ? fmt::format(" and {} more{}", part.count - 1, key.first == Sort::untested ? "" : " of these scenes")
                            : "",
                        reason_of(*part.first));
  // Nothing else tells a walk that never ends from one that is slow.
  if (std::all_of(run.cells.begin(), run.cells.end(), [](const CellRecord& cell) { return cell.status == Status::not_run; }))
    text += "no cell was done in time: does `propose` return false at the end of the ray, and does `theory` end?\n";
  return text;
}

}  // namespace nullmark
