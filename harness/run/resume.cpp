#include "harness/run/resume.h"

#include <filesystem>

#include "harness/io/file_io.h"
#include "harness/io/results_json.h"

namespace nullmark {
namespace {

void keep(const Plan& plan, std::vector<CellRecord> records, Earlier& earlier) {
  std::map<std::pair<std::string, std::string>, std::size_t> places;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) places[{plan.cells[i].id, plan.cells[i].name}] = i;
  for (CellRecord& record : records)
    if (const auto at = places.find({record.cell.id, record.cell.name}); at != places.end())
      earlier[at->second] = std::move(record);
}

}  // namespace

Earlier earlier_results(const Plan& plan, const std::string& output, const Journal& journal, Builds builds) {
  Earlier earlier;
  if (std::filesystem::exists(output)) {
    RunRecord before = read_results(read_file(output), output);
    if (before.config_text != plan.config_text)
      throw InputError(output +
                       ": holds results of another configuration or seed; --resume needs the same, and --force replaces them");
    const Build build = build_of(before.provenance);
    expect_joinable(output, build, "this program", this_build(), builds);
    for (CellRecord& record : before.cells) mark_build(record, build, this_build());
    keep(plan, std::move(before.cells), earlier);
  }
  keep(plan, journal.cells(), earlier);
  return earlier;
}

CellRecord placed(CellRecord record, const Cell& cell) {
  const std::uint64_t samples = record.cell.samples_per_ray;
  record.cell = cell;
  if (cell.equal_lookups) record.cell.samples_per_ray = samples;
  return record;
}

}  // namespace nullmark
