#include "harness/run/covering.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>

namespace nullmark {
namespace {

using Combinations = std::array<std::string, 4>;

/// "/optical_depth:3" of "linear/lo:0.2,0,0/optical_depth:3": what the label says beside the type and the box.
std::string depth_of(const MediumSpec& medium) {
  std::string depth;
  for (std::size_t at = medium.label.find('/'); at != std::string::npos;) {
    const std::size_t next = medium.label.find('/', at + 1);
    const std::string part = medium.label.substr(at, next - at);
    if (!part.starts_with("/lo:") && !part.starts_with("/hi:")) depth += part;
    at = next;
  }
  return depth;
}

Combinations combinations_of(const Plan& plan, const Cell& cell) {
  const MediumSpec& medium = *plan.media[cell.medium];
  const std::string &estimator = cell.estimator->label, &type = medium.field.type,
                    &majorant = plan.majorants[cell.majorant]->label;
  return {fmt::format("estimator {} medium {}", estimator, type), fmt::format("medium {} majorant {}", type, majorant),
          fmt::format("estimator {} depth {}", estimator, depth_of(medium)),
          fmt::format("estimator {} majorant {} experiment {}", estimator, majorant, cell.experiment)};
}

}  // namespace

std::vector<bool> covering_cells(const Plan& plan) {
  std::vector<Combinations> all;
  all.reserve(plan.cells.size());
  for (const Cell& cell : plan.cells) all.push_back(combinations_of(plan, cell));
  std::vector<bool> chosen(all.size());
  std::set<std::string> met;
  // What a cell adds only ever shrinks, so one pass for each number takes all cells that add so many.
  for (std::ptrdiff_t adds = std::tuple_size_v<Combinations>; adds > 0; --adds)
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (std::count_if(all[i].begin(), all[i].end(), [&](const std::string& one) { return !met.contains(one); }) != adds)
        continue;
      chosen[i] = true;
      met.insert(all[i].begin(), all[i].end());
    }
  return chosen;
}

}  // namespace nullmark
