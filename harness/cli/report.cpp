#include <fmt/format.h>

#include <filesystem>

#include "harness/cli/commands.h"
#include "harness/io/file_io.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/io/shell_word.h"
#include "harness/model/program_name.h"
#include "harness/report/comparison_text.h"
#include "harness/report/data.h"
#include "harness/report/figures.h"
#include "harness/report/page.h"
#include "harness/report/warnings.h"

namespace nullmark {
namespace {

/// "c.html" of "results/c.results.json.gz", in the current folder, where `run` puts its results.
std::string default_page(const std::string& results) {
  std::string name = std::filesystem::path(results).filename().string();
  for (const std::string_view ending : {".gz", ".json", ".results"})
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  return name + ".html";
}

}  // namespace

ExitCode report_command(const ReportCommand& given) {
  ReportCommand command = given;
  if (command.output.empty()) command.output = default_page(command.results[0]);
  refuse_overwriting_others(command.results, {{command.output, page_beginning()}, {command.markdown, "### nullmark compare"}});
  if (!command.figures.empty()) expect_figures_possible(command.figures);
  std::vector<RunRecord> runs;
  for (const std::string& file : command.results) runs.push_back(read_results_file(file));
  std::string words = program_name() + " report";
  for (const std::string& file : command.results) words += " " + shell_word(file);
  const ReportData data = report_data(runs, command.results, command.baseline, words + " -o " + shell_word(command.output));
  write_atomically(command.output, report_page(data.json));
  if (!command.markdown.empty()) write_atomically(command.markdown, compare_markdown(runs, command.baseline, true));
  notice("report: {}\n", command.output);
  if (!command.figures.empty()) notice("figures: {} in {}\n", write_figures(command.output, command.figures), command.figures);
  for (const std::string& warning : data.warnings) notice("nullmark: warning: {}\n", warning);
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (const auto remark = busy_remark(runs[i])) notice("nullmark: warning: {}: {}\n", command.results[i], *remark);
  return ExitCode::ok;
}

}  // namespace nullmark
