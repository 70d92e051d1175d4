#include "harness/cli/command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "harness/analysis/hard_case_table.h"
#include "harness/cli/commands.h"
#include "harness/cli/sampling_options.h"
#include "harness/cli/shell_help.h"
#include "harness/config/schema.h"
#include "harness/io/file_io.h"
#include "harness/io/fitted.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/io/shell_word.h"
#include "harness/io/text.h"
#include "harness/performance_gate/required.h"
#include "harness/report/check_text.h"
#include "harness/report/comparison_text.h"
#include "harness/report/export.h"
#include "harness/report/junit.h"
#include "harness/report/warnings.h"
#include "harness/run/provenance.h"
#include "media/volumes/vdb_writer.h"

namespace nullmark {
namespace {

/// Text to a file, or to standard output for "" and "-".
void deliver(const std::string& text, const std::string& output) {
  if (output.empty() || output == "-")
    fmt::print("{}", text);
  else
    write_atomically(output, text);
}

std::vector<RunRecord> load_all(const std::vector<std::string>& files) {
  std::vector<RunRecord> runs;
  runs.reserve(files.size());
  for (const std::string& file : files) runs.push_back(read_results_file(file));
  return runs;
}

void warn(const std::string& file, const std::optional<std::string>& remark) {
  if (remark) notice("nullmark: warning: {}: {}\n", file, one_line(*remark));
}

/// Throws InputError where the word is none of the names.
void expect_one_of(const std::string& word, const std::vector<std::string>& names, const char* what) {
  if (std::find(names.begin(), names.end(), word) != names.end()) return;
  const std::string near = nearest(word, names);
  throw InputError(fmt::format(
      "unknown {} \"{}\"; {}", what, word,
      near.empty() ? fmt::format("expected one of {}", fmt::join(names, ", ")) : fmt::format("did you mean \"{}\"?", near)));
}

/// The commands of the program, what they take, and what the user asked of them.
class CommandLine {
 public:
  CommandLine(int argc, char** argv) {
    run_.command_line.assign(argv, argv + argc);
    app_.set_version_flag("--version", version_line());
    app_.require_subcommand(1);
    app_.failure_message(CLI::FailureMessage::simple);
    add_run();
    add_prove();
    add_problem();
    add_judge();
    add_replay();
    add_check();
    add_compare();
    add_gate();
    add_history();
    add_report();
    add_list();
    add_schema();
    add_export();
    add_merge();
    add_make_volume();
    add_help();
  }

  ExitCode execute() {
    const std::vector<std::string>& words = run_.command_line;
    if (words.size() <= 1) {
      fmt::print("{}", app_.help());
      return ExitCode::ok;
    }
    refuse_unknown_command(words[1]);
    refuse_unknown_option(words);
    std::vector<std::string> reversed(words.rbegin(), words.rend() - 1);
    try {
      app_.parse(reversed);
    } catch (const CLI::ParseError& error) {
      // Help and version end the parse by throwing as well.
      if (error.get_exit_code() == 0) return static_cast<ExitCode>(app_.exit(error));
      const bool missing = dynamic_cast<const CLI::RequiredError*>(&error);
      throw InputError(one_line(error.what()) + (missing ? fmt::format("; `nullmark {} --help` explains it", words[1]) : ""));
    }
    return action_();
  }

 private:
  void refuse_unknown_command(const std::string& word) const {
    std::vector<std::string> names;
    for (const CLI::App* command : app_.get_subcommands({})) names.push_back(command->get_name());
    if (word.rfind('-', 0) != 0) expect_one_of(word, names, "command");
  }

  /// CLI11 refuses it as well, but does not tell the nearest.
  void refuse_unknown_option(const std::vector<std::string>& words) const {
    if (words[1].rfind('-', 0) == 0) return;
    std::vector<std::string> names;
    for (const CLI::Option* option : app_.get_subcommand(words[1])->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (std::size_t i = 2; i < words.size() && words[i] != "--"; ++i) {
      const std::string word = words[i].substr(0, words[i].find('='));
      const bool lacks_a_dash = std::find(names.begin(), names.end(), "-" + word) != names.end();
      if (word.rfind("--", 0) == 0 || lacks_a_dash) expect_one_of(word, names, "option");
    }
  }

  template <class Action>
  CLI::App* add(const char* name, const char* text, Action action) {
    CLI::App* command = app_.add_subcommand(name, text);
    command->final_callback([this, action] { action_ = action; });
    return command;
  }

  void add_run() {
    declare_run(*add("run", "Run configurations and write their results", [this] { return run_command(run_); }), run_);
  }

  void add_prove() {
    declare_prove(*add("prove", "Try one tracker on many scenes, or one medium; exit code 3 if a bias is proven",
                       [this] {
                         if (prove_.estimator.empty() && prove_.medium.empty())
                           throw InputError("prove what? expected an estimator, --medium MEDIUM, or both");
                         prove_.command_line = run_.command_line;
                         return prove_command(prove_);
                       }),
                  prove_);
  }

  void add_problem() {
    declare_problem(*add("problem", "Write scenes to a folder, for a renderer whose samples `judge` shall judge",
                         [this] { return problem_command(problem_); }),
                    problem_);
  }

  void add_judge() {
    declare_judge(*add("judge", "Judge samples in files; exit code 0 for PASS, 3 for FAIL, 77 if undecided",
                       [this] {
                         expect_one_of(judge_.range, {"signed", "non_negative", "unit", "binary"}, "range");
                         judge_.command_line = run_.command_line;
                         return judge_command(judge_);
                       }),
                  judge_);
  }

  void add_replay() {
    declare_replay(*add("replay", "Draw one sample of a cell again and print every random number, lookup and weight",
                        [this] { return replay_command(replay_); }),
                   replay_);
  }

  void add_check() {
    CLI::App* command = add("check", "Print verdicts on bias and expected lookups, derived from the results file alone", [this] {
      refuse_overwriting_others({file_}, {{junit_, kJunitBeginning}, {markdown_, "### nullmark check"}});
      RunRecord run = load_all({file_})[0];
      const Summary summary = summarise(run, strict_);
      if (!junit_.empty()) write_atomically(junit_, junit(run, file_));
      if (!markdown_.empty())
        write_atomically(markdown_, fmt::format("{}{}{}", summary_markdown(run, summary, file_), cases_ ? "\n" : "",
                                                cases_ ? stability_markdown(run) : ""));
      const std::string all = fmt::format("{} check --all {}", shell_word(run_.command_line[0]), shell_word(file_));
      tell("{}", wrapped(summary_text(run, summary, all_, all), terminal_width()));
      if (cases_) tell("\n{}", stability_text(run));
      warn(file_, version_remark(run));
      warn(file_, busy_remark(run));
      return summary.exit;
    });
    command->add_option("RESULTS", file_, "Results file")->required();
    command->add_flag("--all", all_, "Also list every cell that needs no look");
    command->add_flag("--cases", cases_,
                      "Also show for each experiment and tracker if all samples were finite, the largest sample, worst error, "
                      "guards that fired");
    command->add_flag("--strict", strict_, "Exit with code 77 if any cell that claims something is not decided");
    command->add_option("--junit", junit_, "Also write a JUnit report");
    command->add_option("--markdown", markdown_, "Also write a summary for a pull request");
  }

  void add_compare() {
    CLI::App* command = add("compare", "Rank estimators by what accuracy costs in time", [this] {
      refuse_overwriting_others(files_, {{markdown_, "### nullmark compare"}, {latex_, kLatexBeginning}});
      expect_columns(columns_, comparison_columns());
      const std::vector<RunRecord> runs = load_all(files_);
      const std::string ranking = compare_text(runs, baseline_, paired_, {terminal_width(), columns_});
      if (ranking.empty()) {
        notice(
            "nullmark: no cell of these results was sampled as a whole, or they are pairs, which are not ranked; nothing to "
            "compare; `merge` joins shards\n");
        return ExitCode::nothing_ran;
      }
      tell("{}", wrapped(ranking, terminal_width()));
      for (std::size_t i = 0; i < runs.size(); ++i) {
        warn(files_[i], version_remark(runs[i]));
        warn(files_[i], single_bound_remark(runs[i]));
        warn(files_[i], busy_remark(runs[i]));
      }
      if (!markdown_.empty()) write_atomically(markdown_, compare_markdown(runs, baseline_, paired_));
      if (!latex_.empty()) write_atomically(latex_, compare_latex(runs, baseline_));
      return ExitCode::ok;
    });
    command->add_option("RESULTS", files_, "Results files")->required();
    command->add_option("--baseline", baseline_, "Estimator to compare the others with");
    command
        ->add_option("--columns", columns_,
                     "Columns to show, with commas: " + fmt::format("{}", fmt::join(comparison_columns(), ",")))
        ->delimiter(',')
        ->allow_extra_args(false);
    command->add_flag("--paired", paired_, "Also compare mean squared errors on common random streams");
    command->add_option("--markdown", markdown_, "Also write the tables for a pull request");
    command->add_option("--latex", latex_, "Also write the tables for a paper (LaTeX, packages booktabs and graphicx)");
  }

  void add_gate() {
    CLI::App* command = add("gate", "Compare the cost of cells with a baseline; exit code 4 if a regression is proven",
                            [this] { return gate_command(gate_); });
    command->add_option("--baseline", gate_.baseline, "Results, a baseline, or a folder of baselines")->required();
    command->add_option("RESULTS", gate_.results, "Results file")->required();
    command
        ->add_option("--threshold", gate_.threshold,
                     "Percent that a change must exceed; defaults of tiers 1 to 6: 0, 1, .2 to 1 (by history), 5, 5, 1")
        ->check(CLI::Range(0., 1000.));
    CLI::Option* require =
        command
            ->add_option("--require", gate_.require,
                         fmt::format("Tiers that must be compared, with commas: {}; left out: all that the baseline holds",
                                     fmt::join(required_words(), ",")))
            ->delimiter(',')
            ->allow_extra_args(false);
    CLI::Option* blocks =
        command->add_option("--blocks", gate_.blocks, "Folder of scripts/compare-builds: compare wall time as well");
    command->add_flag("--quiet-machine", gate_.quiet_machine, "Count a slower wall time as a regression, not only as a remark")
        ->needs(blocks);
    command->add_flag("--update", gate_.update, "Make the results the baseline")->excludes(blocks)->excludes(require);
    command->add_option("--junit", gate_.junit, "Also write a JUnit report");
    command->add_option("--markdown", gate_.markdown, "Also write a summary for a pull request");
  }

  void add_history() {
    CLI::App* command = add("history", "Show what changed over results of one configuration, in the order of their dates",
                            [this] { return history_command(history_); });
    command->add_option("RESULTS", history_.results, "Results files, in any order")->required();
    command->add_option("--blocks", history_.blocks,
                        "Folder of scripts/compare-builds for the programs of the last two: judge wall time as well");
    command->add_flag("--json", history_.json, "Print JSON, with the figures of every cell in every result");
  }

  void add_report() {
    CLI::App* command =
        add("report", "Write one self-contained page with tables and plots", [this] { return report_command(report_); });
    command->add_option("RESULTS", report_.results, "Results files")->required();
    command->add_option("-o,--output", report_.output,
                        "HTML file to write, by default that of the first results with .html; replaces an existing page");
    command->add_option("--baseline", report_.baseline, "Estimator to compare the others with");
    command->add_option("--figures", report_.figures, "Folder for the main plots as PNG, SVG and PDF; needs Chromium");
    command->add_option("--markdown", report_.markdown, "Also write the rankings for a pull request");
  }

  void add_list() {
    CLI::App* command = add("list", "List the names that configurations may use, with parameters and sources", [this] {
      if (list_.what.empty()) throw InputError(fmt::format("list what? expected one of {}", fmt::join(kLists, ", ")));
      expect_one_of(list_.what, kLists, "list");
      return list_command(list_);
    });
    command->add_option("WHAT", list_.what, "estimators, media, majorants, rays or quantities");
    command->add_option("NAME", list_.name, "Only this one of them");
    command->add_flag("--json", list_.json, "Print JSON");
  }

  void add_schema() {
    CLI::App* command = add("schema", "Print a JSON Schema (draft-07)", [this] {
      expect_one_of(schema_, kSchemas, "schema");
      fmt::print("{}\n", (schema_ == "config" ? config_schema() : results_schema()).dump(2));
      return ExitCode::ok;
    });
    command->add_option("WHICH", schema_, "config or results")->required();
  }

  void add_export() {
    CLI::App* command = add("export", "Write results in another program's format", [this] {
      expect_one_of(format_, export_formats(), "format");
      refuse_overwriting_others({file_}, {{output_, export_beginning(format_)}});
      RunRecord run = load_all({file_})[0];
      summarise(run);
      deliver(export_results(run, format_, file_), output_);
      return ExitCode::ok;
    });
    command->add_option("RESULTS", file_, "Results file")->required();
    command->add_option("--format", format_, "google-benchmark, csv, jsonl or junit")->required();
    command->add_option("-o,--output", output_, "Output file (default: standard output)");
  }

  void add_merge() {
    CLI::App* command = add("merge", "Join the results of shards", [this] {
      return merge_command({files_, output_, builds_, force_});
    });
    command->add_option("PART", files_, "Results files of the shards of one configuration")->required();
    command->add_option("-o,--output", output_, "Results file; - for standard output")->required();
    command->add_option("--builds", builds_, kBuilds);
    command->add_flag("--force", force_, "Replace existing results");
  }

  void add_make_volume() {
    CLI::App* command = add("make-volume", "Write a procedural smoke volume (OpenVDB, grid \"density\")", [this] {
      expect_new(file_, force_, " BDV");
      expect_plain_or_none(file_);
      if (std::filesystem::path(file_).extension() != ".vdb")
        throw InputError(fmt::format("{}: a volume is written as OpenVDB; expected a name that ends in .vdb", file_));
      write_procedural_vdb(file_, volume_);
      notice("volume: {}\n", file_);
      return ExitCode::ok;
    });
    command->add_option("FILE", file_, "File to write")->required();
    command->add_option("--seed", volume_.seed, "Seed of the noise");
    command->add_option("--resolution", volume_.resolution, "Voxels across the box");
    command->add_flag("--half", volume_.half, "Store 16-bit values");
    command->add_flag("--force", force_, "Replace an existing file");
  }

  void add_help() {
    CLI::App* help = add("help", "Print what a command takes", [this] {
      if (!word_.empty()) refuse_unknown_command(word_);
      // The program's own help would be that of the command under way.
      fmt::print("{}", word_.empty() ? app_.get_formatter()->make_help(&app_, app_.get_name(), CLI::AppFormatMode::Normal)
                                     : app_.get_subcommand(word_)->help(app_.get_name()));
      return ExitCode::ok;
    });
    help->add_option("COMMAND", word_, "A command; without it, the list of them");
    CLI::App* completion = add("completion", "Print a script that completes commands and options in a shell", [this] {
      expect_one_of(word_, completed_shells(), "shell");
      fmt::print("{}", completion_script(app_, word_));
      return ExitCode::ok;
    });
    completion->add_option("SHELL", word_, "bash, zsh or fish")->required();
    add("manual", "Print the page for man, section 1", [this] {
      fmt::print("{}", manual_page(app_, version_line()));
      return ExitCode::ok;
    });
  }

  CLI::App app_{"Benchmark and validation harness for null-collision trackers", "nullmark"};
  std::function<ExitCode()> action_;
  RunCommand run_;
  ProveCommand prove_;
  ProblemCommand problem_;
  JudgeCommand judge_;
  ReplayCommand replay_;
  GateCommand gate_;
  HistoryCommand history_;
  ReportCommand report_;
  ListCommand list_;
  ProceduralVdb volume_;
  std::vector<std::string> files_, columns_;
  std::string file_, baseline_, builds_, schema_, format_, output_, junit_, markdown_, latex_, word_;
  bool force_ = false, paired_ = false, cases_ = false, all_ = false, strict_ = false;
};

}  // namespace

ExitCode execute_command_line(int argc, char** argv) { return CommandLine(argc, argv).execute(); }

}  // namespace nullmark
