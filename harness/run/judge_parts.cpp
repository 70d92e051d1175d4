#include "harness/run/judge_parts.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "harness/config/config.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/run/run.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {

std::vector<std::string> judge_parts(RunRecord& merged, const std::string& file, const std::string& output) {
  std::map<std::string, CellRecord*> split;
  for (CellRecord& record : merged.cells)
    if (!record.drawn_parts.empty()) split[record.cell.name] = &record;
  if (split.empty()) return {};
  const Plan plan = read_config(merged.config_text, file + "#config");
  std::vector<bool> selected(plan.cells.size());
  std::vector<CellRecord> drawn;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    const Cell& cell = plan.cells[i];
    const auto at = split.find(cell.name);
    if (at == split.end()) continue;
    if (is_from_outside(cell))
      throw InputError(fmt::format("{}: cell \"{}\": found parts of a cell whose tracker is from outside; expected it whole",
                                   file, cell.name));
    selected[i] = true;
    drawn.push_back(*at->second);
  }
  RunOptions options;
  options.timing = false;
  options.may_draw = false;
  if (!output.empty()) {
    const std::filesystem::path images = std::filesystem::path(output).replace_extension(".images");
    options.image_directory = images.string();
    options.image_prefix = images.filename().string();
  }
  RunObserver observer;
  observer.warning = [](const std::string& message) { notice("nullmark: warning: {}\n", message); };
  std::vector<std::string> open;
  for (CellRecord& judged : unshared(run_plan(plan, selected, drawn, options, observer))) {
    CellRecord& record = *split.at(judged.cell.name);
    judged.time = record.time;
    if (!judged.drawn_parts.empty()) open.push_back(judged.cell.name);
    record = std::move(judged);
  }
  return open;
}

}  // namespace nullmark
