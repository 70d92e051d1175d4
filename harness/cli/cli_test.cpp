#include "harness/model/exit_code.h"
#include "harness/registry/estimator_entry.h"
#include "harness/run/journal.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class Cli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":50,
       "matrix":{"estimator":["ratio","delta","residual_ratio"],"medium":["linear",{"type":"linear","end":2}]}}]})");
  }

  static int code(ExitCode exit) { return static_cast<int>(exit); }
};

TEST_F(Cli, RunWritesResultsAndRefusesToReplaceThem) {
  EXPECT_EQ(run("run c.json"), 0) << read("err");
  EXPECT_EQ(results("c.results.json").cells.size(), 6u);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.results.json.journal"));
  EXPECT_NE(read("out").find("e: linear/end:2, global, transmittance"), std::string::npos);
  EXPECT_EQ(run("run c.json"), code(ExitCode::input_error));
  EXPECT_EQ(read("err"), "nullmark: c.results.json: exists; --resume completes it, --force replaces it\n");
  EXPECT_EQ(run("run c.json --force"), 0);
}

TEST_F(Cli, NoOutputReplacesAnInputOrAnotherOutput) {
  ASSERT_EQ(run("run c.json -o a.json"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json"), 0) << read("err");
  std::filesystem::create_symlink("a.json", folder_ / "link");
  std::filesystem::create_hard_link(folder_ / "a.json", folder_ / "hard");
  std::filesystem::create_symlink("new.html", folder_ / "dangling");
  std::filesystem::create_directory(folder_ / "folder");
  std::filesystem::copy_file(folder_ / "c.json", folder_ / "folder/d.json");
  write("v.vdb", "a volume");
  write("v.json", R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,
      "matrix":{"estimator":"ratio","medium":{"type":"vdb","file":"v.vdb"}}}]})");
  const std::string before = read("a.json"), config = read("c.json");
  for (const char* arguments :
       {"report a.json -o a.json", "report a.json -o ./folder/../a.json", "report a.json b.json -o link", "report a.json -o hard",
        "report a.json -o c.html --markdown c.html", "report a.json -o new.html --markdown dangling",
        "compare a.json b.json --markdown a.json", "check a.json --junit a.json", "check a.json --junit x --markdown ./x",
        "export a.json --format csv -o a.json", "merge a.json b.json -o a.json --force", "run c.json -o c.json --force",
        "run folder -o folder/d.json --force", "run v.json -o v.vdb --force", "gate --baseline a.json b.json --junit a.json"}) {
    EXPECT_EQ(run(arguments), code(ExitCode::input_error)) << arguments;
    const std::string error = read("err");
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << arguments << ": " << error;
    EXPECT_NE(error.find("give "), std::string::npos) << error;
    EXPECT_EQ(read("out"), "") << arguments;
    ASSERT_TRUE(read("a.json") == before) << arguments;
  }
  EXPECT_EQ(read("c.json"), config);
  EXPECT_EQ(read("folder/d.json"), config);
  EXPECT_EQ(read("v.vdb"), "a volume");
  for (const char* absent : {"c.html", "new.html", "x", "c.json.journal"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / absent));
}

TEST_F(Cli, StandardOutputCarriesOnlyTheResults) {
  EXPECT_EQ(run("run - -o -", NULLMARK_PROGRAM, "c.json"), 0) << read("err");
  EXPECT_EQ(read_results(read("out"), "out").cells.size(), 6u);
}

TEST_F(Cli, StatisticsDoNotDependOnThreadsShardsOrResume) {
  ASSERT_EQ(run("run c.json -o whole.json --threads 1"), 0);
  const std::string expected = statistics_text(results("whole.json"));
  ASSERT_EQ(run("run c.json -o threads.json --threads 3"), 0);
  EXPECT_EQ(statistics_text(results("threads.json")), expected);
  ASSERT_EQ(run("run c.json -o a.json --shard 1/2"), 0);
  ASSERT_EQ(run("run c.json -o b.json --shard 2/2"), 0);
  EXPECT_EQ(results("a.json").cells.size(), 3u);
  ASSERT_EQ(run("merge b.json a.json -o merged.json"), 0) << read("err");
  EXPECT_EQ(statistics_text(results("merged.json")), expected);
  ASSERT_EQ(run("run c.json -o parts.json --filter ^ratio"), 0);
  EXPECT_EQ(results("parts.json").cells.size(), 2u);
  ASSERT_EQ(run("run c.json -o parts.json --resume"), 0) << read("err");
  EXPECT_NE(read("err").find("[4/4]"), std::string::npos) << read("err");
  EXPECT_EQ(statistics_text(results("parts.json")), expected);
}

TEST_F(Cli, ResumesFromTheJournalOfAKilledRun) {
  ASSERT_EQ(run("run c.json -o whole.json"), 0);
  const RunRecord whole = results("whole.json");
  {
    Journal journal((folder_ / "r.json").string(), Json::parse(read("whole.json"))["config_hash"], Journal::Mode::fresh,
                    build_of(whole.provenance));
    journal.append(whole.cells[4]);
    EXPECT_EQ(run("run c.json -o r.json --force"), code(ExitCode::input_error)) << "the journal is locked";
  }
  EXPECT_EQ(run("run c.json -o r.json"), code(ExitCode::input_error));
  EXPECT_EQ(run("run c.json -o r.json --resume --seed 2"), code(ExitCode::input_error));
  EXPECT_EQ(run("run c.json -o r.json --resume"), 0) << read("err");
  EXPECT_NE(read("err").find("[5/5]"), std::string::npos) << read("err");
  EXPECT_EQ(statistics_text(results("r.json")), statistics_text(whole));
}

TEST_F(Cli, SeedsChangeStatisticsAndAreRecorded) {
  ASSERT_EQ(run("run c.json -o a.json --seed 7"), 0);
  EXPECT_EQ(results("a.json").cells[0].cell.seed, 7u);
  ASSERT_EQ(run("run c.json -o b.json --seed random"), 0);
  EXPECT_NE(statistics_text(results("a.json")), statistics_text(results("b.json")));
}

TEST_F(Cli, InterruptKeepsWhatIsDone) {
  write("long.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":{"type":"orthographic"},"samples_per_ray":[1],"matrix":{"estimator":"ratio","medium":["linear"]}},
      {"name":"f","rays":{"type":"orthographic","width":64,"height":64},"samples_per_ray":2000000,"matrix":{"estimator":"ratio","medium":["linear"]}}]})");
  // Interrupted once the journal holds its head and the first cell.
  const std::string command =
      "cd '" + folder_.string() +
      "' && { '" NULLMARK_PROGRAM
      "' run long.json >out 2>err & }; "
      "while kill -0 $! && [ \"$(cat long.results.json.journal | wc -l)\" -lt 2 ]; do sleep .05; done 2>/dev/null; "
      "kill -INT $!; wait $!";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), code(ExitCode::interrupted));
  const RunRecord partial = results("long.results.json");
  ASSERT_EQ(partial.cells.size(), 2u);
  EXPECT_EQ(partial.cells[0].status, Status::ok);
  EXPECT_EQ(partial.cells[1].status, Status::not_run);
}

TEST_F(Cli, ErrorsAreOneLineWithTheRightCode) {
  write(
      "bad.json",
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratoi","medium":"linear"}}]})");
  write(
      "clash.json",
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":{"type":"linear","hi":[0,1,1]}}}]})");
  write(
      "missing.json",
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":{"type":"vdb","file":"nowhere.vdb"}}}]})");
  write(
      "optional.json",
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":{"type":"vdb","file":"nowhere.vdb","optional":true}}}]})");
  const std::vector<std::pair<std::string, ExitCode>> cases = {{"rnu", ExitCode::input_error},
                                                               {"run", ExitCode::input_error},
                                                               {"run nowhere.json", ExitCode::input_error},
                                                               {"run c.json --shard 3/2", ExitCode::input_error},
                                                               {"run c.json --filter '('", ExitCode::input_error},
                                                               {"run c.json --seed -1", ExitCode::input_error},
                                                               {"run c.json --filter nothing", ExitCode::nothing_ran},
                                                               {"run bad.json", ExitCode::input_error},
                                                               {"run clash.json", ExitCode::input_error},
                                                               {"run missing.json", ExitCode::input_error},
                                                               {"compare c.json", ExitCode::input_error},
                                                               {"list estimator", ExitCode::input_error}};
  for (const auto& [arguments, exit] : cases) {
    EXPECT_EQ(run(arguments), code(exit)) << arguments;
    const std::string error = read("err");
    EXPECT_EQ(error.rfind("nullmark: ", 0), 0u) << arguments << ": " << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << arguments << ": " << error;
    EXPECT_EQ(read("out"), "") << arguments;
  }
  run("run clash.json");
  EXPECT_EQ(read("err").rfind("nullmark: clash.json: /experiments/0/matrix/medium/hi: ", 0), 0u) << read("err");
  EXPECT_EQ(run("run optional.json"), code(ExitCode::nothing_ran));
  EXPECT_EQ(results("optional.results.json").cells.at(0).status, Status::skipped);
}

TEST_F(Cli, MessagesNameTheMistakeAndTheRemedy) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  std::filesystem::create_directory(folder_ / "folder");
  const std::string results_text = read("r.json");
  std::filesystem::create_directory(folder_ / "results");
  for (const char* name : {"results/b.json", "results/a.json", "results/0.txt"}) write(name, results_text);
  write("cut.json", results_text.substr(0, results_text.size() / 2));
  write("empty.json", "");
  write("page.html", "<!doctype html>");
  write("other.json", "{\"a\": 1}");
  const std::vector<std::pair<const char*, const char*>> cases = {
      {"check nowhere.json", "nowhere.json: no such file; `nullmark run CONFIG -o nowhere.json` writes it"},
      {"merge r.json nowhere.json -o m.json", "nowhere.json: no such file; `nullmark run"},
      {"replay nowhere.json cell", "nowhere.json: no such file; `nullmark run"},
      {"report nowhere.json -o r.html", "nowhere.json: no such file; `nullmark run"},
      {"run nowhere.json", "nowhere.json: no such file"},
      {"check folder", "folder: is a folder; expected a results file"},
      {"check results", "results: is a folder; expected a results file, such as results/a.json"},
      {"check c.json", "c.json: is a configuration; `nullmark run` it first"},
      {"run r.json", "r.json: is a results file; nullmark check, compare and report read it"},
      {"check other.json", "is not a results file of nullmark"},
      {"check page.html", "is not a results file of nullmark"},
      {"check cut.json",
       "ends in the middle; expected the whole of a JSON file; copy the results again, or run their configuration"},
      {"check empty.json", "is empty; expected JSON; copy the results again"},
      {"list", "expected one of estimators, media"},
      {"run c.json --thread 2", "unknown option \"--thread\"; did you mean \"--threads\"?"},
      {"run c.json --thread=2", "did you mean \"--threads\"?"},
      {"run c.json -threads 2", "unknown option \"-threads\"; did you mean \"--threads\"?"},
      {"merge r.json", "--output is required; `nullmark merge --help` explains it"},
      {"list quantites", "did you mean \"quantities\"?"},
      {"schema confg", "did you mean \"config\"?"},
      {"export r.json --format cvs", "did you mean \"csv\"?"},
      {"compare r.json --baseline nosuch", "they have delta, ratio, residual_ratio"},
      {"report r.json -o r.html --figures c.json", "--figures: c.json: "},
      {"report r.json -o r.html --figures c.json/x", "is not a folder"}};
  for (const auto& [arguments, words] : cases) {
    EXPECT_EQ(run(arguments), code(ExitCode::input_error)) << arguments;
    const std::string error = read("err");
    EXPECT_NE(error.find(words), std::string::npos) << arguments << ": " << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << arguments << ": " << error;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "r.html"));
  EXPECT_EQ(run(""), 0);
  EXPECT_NE(read("out").find("compare"), std::string::npos);
}

TEST_F(Cli, APageIsNamedAfterTheFirstResults) {
  std::filesystem::create_directory(folder_ / "folder");
  ASSERT_EQ(run("run c.json -o folder/some.results.json"), 0) << read("err");
  EXPECT_EQ(run("report folder/some.results.json folder/some.results.json"), 0) << read("err");
  EXPECT_EQ(read("err"), "report: some.html\n");
  EXPECT_TRUE(std::filesystem::exists(folder_ / "some.html"));
  write("own.html", "a page of somebody else");
  std::filesystem::rename(folder_ / "folder/some.results.json", folder_ / "own.json");
  EXPECT_EQ(run("report own.json"), code(ExitCode::input_error));
  EXPECT_EQ(read("own.html"), "a page of somebody else");
}

TEST_F(Cli, UniformNextEventsUnderNarrowPhaseFunctionsAreWarnedOf) {
  for (const char* next_event : {"uniform", "mis"})
    for (const Real anisotropy : {0.5, -0.9}) {
      write("g.json",
            fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e","rays":"single",
          "samples_per_ray":10,"quantity":"radiance","transport":{{"environment":1,"next_event":"{}"}},
          "matrix":{{"estimator":"delta","medium":{{"type":"linear","albedo":0.5,"anisotropy":{}}}}}}}]}})",
                        next_event, anisotropy));
      EXPECT_EQ(run("run g.json --force"), 0) << read("err");
      const bool warned = read("err").find("draws next events uniformly under a mean cosine of -0.9") != std::string::npos;
      EXPECT_EQ(warned, std::string(next_event) == "uniform" && anisotropy < 0) << read("err");
    }
}

TEST_F(Cli, FiguresWithoutABrowserAreRefusedAtOnce) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  const char* path = std::getenv("PATH");
  const std::string before = path ? path : "";
  ::setenv("PATH", folder_.c_str(), 1);
  const std::string command =
      fmt::format("cd '{}' && '{}' report r.json -o r.html --figures f 2>err", folder_.string(), NULLMARK_PROGRAM);
  const int status = std::system(command.c_str());
  ::setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(WEXITSTATUS(status), code(ExitCode::input_error));
  EXPECT_NE(read("err").find("apt install chromium"), std::string::npos) << read("err");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "r.html"));
}

TEST_F(Cli, TimingTellsHowFarItIs) {
  write("t.json", R"({"nullmark":"config/2","timing":{"repetitions":2,"seconds":0.0001},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":10,"matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})");
  ASSERT_EQ(run("run t.json"), 0) << read("err");
  EXPECT_NE(read("err").find("timing 1/2\ntiming 2/2\n"), std::string::npos) << read("err");
}

TEST_F(Cli, AGreyTrackerNamesTheMediumThatItDoesNotTake) {
  write("t.json", R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":10,"matrix":{
      "estimator":["ratio","analog_decomposition"],"medium":["linear",{"type":"linear","spectrum":[0.5,2]}]}}]})");
  EXPECT_EQ(run("run t.json"), 2);
  EXPECT_NE(
      read("err").find("t.json: /experiments/0/matrix/estimator/1/type: analog_decomposition takes grey media only; expected one "
                       "channel, found 2; sweep chromatic media in another experiment"),
      std::string::npos)
      << read("err");
  EXPECT_NE(read("err").find("(medium linear/spectrum:0.5,2)"), std::string::npos) << read("err");
}

TEST_F(Cli, ProveTellsWhichMembersItFound) {
  // It throws in every flight, so it ends at once.
  EXPECT_EQ(run("prove '{\"type\":\"faulty\",\"fault\":\"throws\"}' --quick", NULLMARK_FAULTY_PROGRAM),
            code(ExitCode::internal_error));
  const std::string text = read("out");
  const std::size_t used = text.find("\nuses: theory, "), others = text.find("\nmay also state: ");
  ASSERT_NE(used, std::string::npos) << text;
  EXPECT_LT(used, text.find("transmittance_at"));
  EXPECT_LT(text.find("transmittance_at"), others);
  EXPECT_LT(others, text.find("event"));
  for (std::size_t begin = used + 1; begin < text.find("\nscenes ");) {
    const std::size_t end = text.find('\n', begin);
    EXPECT_LE(end - begin, 100u) << text.substr(begin, end - begin);
    begin = end + 1;
  }
}

TEST_F(Cli, ListsSchemasAndVersion) {
  for (const char* what : {"estimators", "media", "majorants", "rays", "quantities"}) {
    EXPECT_EQ(run(std::string("list ") + what), 0);
    EXPECT_EQ(run(std::string("list --json ") + what), 0);
    EXPECT_FALSE(Json::parse(read("out")).empty()) << what;
  }
  EXPECT_EQ(run("list --json estimators"), 0);
  for (const Json& entry : Json::parse(read("out"))) {
    const std::string name = entry["name"].get<std::string>();
    if (Registry<EstimatorEntry>::instance().find(name)->foreign) continue;
    const auto source = Registry<EstimatorEntry>::instance().find(name)->make();
    const bool in_float = source->kernel(1, Precision::float32) != nullptr;
    EXPECT_EQ(entry["lanes"].get<bool>(), in_float) << name;
    EXPECT_EQ(entry["precisions"].size(), in_float ? 2u : 1u) << name;
    if (name == "ratio" || name == "analog_decomposition") {
      EXPECT_EQ(entry["grey_only"].get<bool>(), name != "ratio") << name;
    }
  }
  for (const char* which : {"config", "results"}) {
    EXPECT_EQ(run(std::string("schema ") + which), 0);
    EXPECT_EQ(Json::parse(read("out"))["$schema"], "http://json-schema.org/draft-07/schema#");
  }
  EXPECT_EQ(run("--version"), 0);
  EXPECT_EQ(read("out").rfind("nullmark ", 0), 0u);
  EXPECT_EQ(run("run --help"), 0);
  EXPECT_EQ(run("run c.json --dry-run"), 0);
  EXPECT_NE(read("out").find("6 cells"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.results.json"));
}

TEST_F(Cli, ListsOneByItsName) {
  EXPECT_EQ(run("list estimators ratio"), 0);
  EXPECT_EQ(read("out").rfind("ratio\n", 0), 0u) << read("out");
  EXPECT_EQ(read("out").find("delta"), std::string::npos) << read("out");
  EXPECT_EQ(run("list media linaer"), 2);
  EXPECT_EQ(read("err"), "nullmark: list media: found \"linaer\"; did you mean \"linear\"?\n");
  EXPECT_EQ(run("list rays nothing_like_it"), 2);
  EXPECT_EQ(read("err"), "nullmark: list rays: found \"nothing_like_it\"; `list rays` shows all of them\n");
}

/// Its own pilot is too small to be trusted.
TEST_F(Cli, ADryRunLeavesTheVerdictToThePilotOfTheRun) {
  for (const auto& [samples, verdict] : {std::pair{1000, " INCONCLUSIVE  ok"}, {1'000'000, "open  ok"}}) {
    write("p.json",
          fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e","rays":"single",
        "samples_per_ray":{},"matrix":{{"estimator":"ratio_roulette","medium":"linear"}}}}]}})",
                      samples));
    EXPECT_EQ(run("run p.json --dry-run"), 0) << read("err");
    EXPECT_NE(read("out").find(verdict), std::string::npos) << read("out");
  }
}

TEST_F(Cli, ADryRunOfNothingEndsAsTheRunWould) {
  write("v.json", R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,
      "matrix":{"estimator":"ratio","medium":{"type":"vdb","file":"absent.vdb","optional":true}}}]})");
  EXPECT_EQ(run("run v.json --dry-run"), code(ExitCode::nothing_ran));
  EXPECT_EQ(read("err"), "nullmark: nothing would run: all cells are skipped\n");
  EXPECT_EQ(run("run v.json"), code(ExitCode::nothing_ran));
}

}  // namespace
}  // namespace nullmark
