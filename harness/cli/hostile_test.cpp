// Small files that ask for much: refused in one line, before memory or the stack is gone.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "harness/config/config.h"
#include "harness/io/json_input.h"
#include "harness/model/exit_code.h"
#include "harness/sampling/ray_memory.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

std::string error_of(const std::string& config) {
  try {
    read_config(config, "c.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int n = 0; n < times; ++n) all += text;
  return all;
}

/// A list of so many numbers, as a sweep.
std::string sweep(int numbers) {
  std::string list = "[";
  for (int n = 1; n <= numbers; ++n) list += std::to_string(n) + (n < numbers ? "," : "]");
  return list;
}

std::string config(const std::string& medium, const std::string& more) {
  return R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","matrix":{"estimator":"ratio","medium":)" + medium +
         "," + more + "}}]}";
}

TEST(Hostile, DeepNestingIsRefusedWhereItBegins) {
  for (const char* bracket : {"[", "{\"a\":"}) {
    try {
      parse_json(repeated(bracket, 1'000'000), "deep.json");
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("deep.json:1:", 0), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find("nested more than 100 deep"), std::string::npos) << error.what();
    }
  }
  EXPECT_NO_THROW(parse_json(repeated("[", 100) + repeated("]", 100), "deep.json"));
}

/// To the parser a byte of value 0 is the end, and what follows it would go unread.
TEST(Hostile, NothingHidesBehindAZero) {
  const std::string whole = config(R"("linear")", R"("samples_per_ray":1)");
  EXPECT_EQ(error_of(whole), "accepted");
  EXPECT_EQ(error_of(whole + std::string("\0garbage", 8)),
            fmt::format("c.json:1:{}: a byte of value 0; expected the text of a JSON file", whole.size() + 1));
}

TEST(Hostile, SweepsThatMultiplyAreRefused) {
  const std::string thousand = sweep(1000);
  const std::string linear = R"({"type":"linear","begin":)" + thousand + R"(,"end":)" + thousand + "}";
  EXPECT_EQ(error_of(config(linear, R"("samples_per_ray":1)")),
            "c.json: /experiments/0/matrix/medium: its sweeps make more than 100000 cells; split them into several files");
  EXPECT_EQ(error_of(config(R"("linear")", R"("samples_per_ray":)" + thousand + R"(,"seed":)" + thousand)),
            "c.json: /experiments/0/matrix: its sweeps make more than 100000 cells; split them into several files");
}

/// Not one experiment alone: the limit is the configuration's.
TEST(Hostile, ExperimentsThatAddUpAreRefused) {
  const auto experiment = [](const std::string& name) {
    return R"({"name":")" + name +
           R"(","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":{"type":"linear","begin":)" +
           sweep(240) + R"(,"end":)" + sweep(240) + "}}}";
  };
  EXPECT_EQ(
      error_of(R"({"nullmark":"config/2","experiments":[)" + experiment("a") + "," + experiment("b") + "]}"),
      "c.json: /experiments/1: with the experiments before it, it makes more than 100000 cells; split them into several files");
}

/// Nor one file alone.
TEST(Hostile, FilesThatAddUpAreRefused) {
  const auto file = [](const char* name) {
    return ConfigSource{
        R"({"nullmark":"config/2","experiments":[{"name":")" + std::string(name) +
            R"(","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":{"type":"linear","begin":)" +
            sweep(240) + R"(,"end":)" + sweep(240) + "}}}]}",
        std::string(name) + ".json"};
  };
  try {
    read_configs({file("a"), file("b")});
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "b.json: with the files before it, it makes more than 100000 cells; run them one by one");
  }
}

/// Seconds, not hours, for as many as are allowed.
TEST(Hostile, ManyCellsAreExpandedInLinearTime) {
  const std::string text =
      config(R"({"type":"linear","begin":)" + sweep(200) + R"(,"end":)" + sweep(100) + "}", R"("samples_per_ray":1)");
  EXPECT_EQ(read_config(text, "c.json").cells.size(), 20000u);
}

/// A thousand cells on the same rays.
std::string many_rays(const std::string& rays) {
  return R"({"nullmark":"config/2","experiments":[{"name":"e","samples_per_ray":1,"matrix":{"estimator":"ratio","rays":)" + rays +
         R"(,"medium":{"type":"linear","end":)" + sweep(1000) + "}}}]}";
}

TEST(Hostile, RaysThatNoMachineHoldsAreRefused) {
  for (const char* rays :
       {R"({"type":"orthographic","width":16384,"height":16384})", R"({"type":"perspective","width":16384,"height":16384})",
        R"({"type":"chords","count":100000000})", R"({"type":"inside","count":100000000})"})
    try {
      const Plan plan = read_config(many_rays(rays), "c.json");
      expect_rays_fit(plan, [](std::size_t) { return true; });
      ADD_FAILURE() << rays;
    } catch (const ParameterError& error) {
      EXPECT_EQ(error.parameter, "c.json: /experiments/0/matrix/rays");
      const std::string message = error.what();
      EXPECT_NE(message.find(" rays, with those of the cells before them, take at least "), std::string::npos) << message;
      EXPECT_NE(message.find("make fewer rays"), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos);
    }
  const Plan plan = read_config(many_rays(R"({"type":"orthographic","width":16384,"height":16384})"), "c.json");
  EXPECT_NO_THROW(expect_rays_fit(plan, [](std::size_t) { return false; })) << "only what is to run counts";
}

class HostileFiles : public ProgramTest {};

/// Within a limit of addresses, so that a program that did ask for the memory would not get it.
TEST_F(HostileFiles, RaysAreCountedBeforeTheyAreMade) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take all addresses";
#endif
  write("c.json", many_rays(R"({"type":"perspective","width":16384,"height":16384})"));
  for (const char* command : {"run c.json", "run c.json --dry-run"}) {
    const std::string limited =
        fmt::format("ulimit -v 4000000; cd '{}' && '{}' {} >out 2>err", folder_.string(), NULLMARK_PROGRAM, command);
    EXPECT_EQ(WEXITSTATUS(std::system(limited.c_str())), static_cast<int>(ExitCode::input_error));
    const std::string error = read("err");
    EXPECT_EQ(error.rfind("nullmark: c.json: /experiments/0/matrix/rays: 268435456 rays", 0), 0u) << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  }
}

/// Of a sum that no double holds.
TEST_F(HostileFiles, AMeanThatOverflowsIsAnError) {
  write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",
    "quantity":"radiance","samples_per_ray":64,"transport":{"environment":1e308},
    "matrix":{"estimator":"delta","medium":{"type":"linear","albedo":0.5}}}]})");
  EXPECT_EQ(run("run c.json -o r.json"), static_cast<int>(ExitCode::internal_error));
  const CellRecord cell = results("r.json").cells.at(0);
  EXPECT_EQ(cell.status, Status::error);
  EXPECT_NE(cell.reason.find("beyond the largest number"), std::string::npos) << cell.reason;
}

/// Names come from strangers; a terminal must not obey them.
TEST_F(HostileFiles, NamesDoNotReachTheTerminalAsCommands) {
  const std::string name = R"(\u001b]0;owned\u0007|<script>)";
  write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"name":")" + name + R"(","experiments":[{"name":")" +
                      name +
                      R"(","rays":"single","samples_per_ray":64,"matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})");
  for (const char* command : {"run c.json -o r.json --force", "check r.json --markdown m.md", "compare r.json",
                              "run c.json --dry-run", "replay r.json nothing", "run c.json --filter '(\x1b'"}) {
    run(command);
    for (const char* stream : {"out", "err"}) {
      const std::string text = read(stream);
      EXPECT_EQ(text.find_first_of("\x1b\x07"), std::string::npos) << command << ": " << text;
    }
  }
  const std::string summary = read("m.md");
  EXPECT_EQ(summary.find("<script"), std::string::npos) << summary;
  EXPECT_EQ(summary.find('\x1b'), std::string::npos) << summary;
}

/// As names are shown they are selected, and a name is one line wherever it stands.
TEST_F(HostileFiles, NamesAreOneLineAndSelectTheirCells) {
  write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"a\nPASS\u202eb","rays":"single",
    "samples_per_ray":64,"matrix":{"estimator":"ratio","medium":"linear"}},{"name":"b","rays":"single",
    "samples_per_ray":64,"matrix":{"estimator":"ratio","medium":"linear"}}]})");
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  const std::string name = results("r.json").cells.at(0).cell.name;
  EXPECT_EQ(name, "a\\x0aPASS\\u202eb/ratio/linear/global");
  EXPECT_EQ(read("out").find("\nPASS"), std::string::npos) << read("out");
  EXPECT_EQ(run("replay r.json '" + name + "'"), 0) << read("err");
  run("check r.json --markdown m.md --all");
  EXPECT_EQ(read("out").find("\nPASS"), std::string::npos) << read("out");
  // Of a file that somebody else made.
  std::string text = read("r.json");
  for (std::size_t at = text.find("\\\\x0a"); at != std::string::npos; at = text.find("\\\\x0a", at)) text.replace(at, 5, "\\n");
  write("s.json", text);
  for (const char* command : {"check s.json --all", "compare s.json"}) {
    run(command);
    EXPECT_EQ(read("out").find("\nPASS"), std::string::npos) << command << ": " << read("out");
  }
}

/// A message that quotes a megabyte hides its remedy.
TEST_F(HostileFiles, MessagesAreShort) {
  const std::string much(1'000'000, '7');
  for (const std::string& text :
       {R"({"nullmark":"config/2","name":)" + much + "}", R"({"nullmark":"config/2",")" + much + R"(":1,"experiments":[]})",
        config(R"("linear")", R"("samples_per_ray":1,")" + much + R"(":1)"), config("\"" + much + "\"", R"("samples_per_ray":1)"),
        config(R"({"type":"vdb","file":")" + much + "\"}", R"("samples_per_ray":1)")}) {
    write("c.json", text);
    EXPECT_EQ(run("run c.json -o r.json"), static_cast<int>(ExitCode::input_error));
    EXPECT_LE(read("err").size(), 2100u);
    EXPECT_EQ(read("err").find('\n'), read("err").size() - 1);
  }
  EXPECT_EQ(run("run c.json -o r.json --filter " + std::string(900, '(')), static_cast<int>(ExitCode::input_error));
}

/// A byte of value 0 does not end the message.
TEST_F(HostileFiles, ZeroesInNamesDoNotCutTheMessage) {
  write("c.json", config(R"("lin\u0000ear")", R"("samples_per_ray":1)"));
  EXPECT_EQ(run("run c.json"), static_cast<int>(ExitCode::input_error));
  EXPECT_NE(read("err").find(R"(unknown medium "lin\x00ear"; did you mean "linear"?)"), std::string::npos) << read("err");
}

/// Only what a command can make again is replaced unasked, and nothing else by it.
TEST_F(HostileFiles, OutputsReplaceOnlyTheirKind) {
  write("c.json", config(R"("linear")", R"("samples_per_ray":64)"));
  ASSERT_EQ(run("run c.json -o r.json --no-timing"), 0) << read("err");
  ASSERT_EQ(run("make-volume v.vdb --resolution 8"), 0) << read("err");
  const std::string kept = read("r.json"), config_text = read("c.json"), volume = read("v.vdb");
  write("other.json", kept);
  write("spaced.json", "{ \"nullmark\" : \"config/2\", \"experiments\": []}");
  write("notes.txt", "precious");
  write("pom.xml", "<project/>");
  for (const char* output : {"other.json", "c.json", "v.vdb", "spaced.json", "notes.txt", "pom.xml"})
    for (const std::string& command :
         {fmt::format("report r.json -o {}", output), fmt::format("export r.json --format csv -o {}", output),
          fmt::format("export r.json --format jsonl -o {}", output), fmt::format("check r.json --junit {}", output),
          fmt::format("check r.json --markdown {}", output), fmt::format("compare r.json --markdown {}", output)}) {
      EXPECT_EQ(run(command), static_cast<int>(ExitCode::input_error)) << command;
      EXPECT_NE(read("err").find("exists and is no earlier output of this kind; remove it, or give the output another path"),
                std::string::npos)
          << command << ": " << read("err");
    }
  // Nor does --force replace what is no results file, or no volume.
  for (const char* output : {"c.json", "v.vdb", "spaced.json", "notes.txt"})
    EXPECT_EQ(run(fmt::format("run c.json -o {} --force --no-timing", output)), static_cast<int>(ExitCode::input_error))
        << output;
  for (const char* output : {"c.json", "other.json", "notes.txt"})
    EXPECT_EQ(run(fmt::format("make-volume {} --resolution 8 --force", output)), static_cast<int>(ExitCode::input_error))
        << output;
  EXPECT_EQ(read("notes.txt"), "precious");
  EXPECT_EQ(read("other.json"), kept);
  EXPECT_EQ(read("c.json"), config_text);
  EXPECT_EQ(read("v.vdb"), volume);
  for (int again = 0; again < 2; ++again)
    for (const char* command :
         {"report r.json -o p.html", "export r.json --format csv -o e.csv", "export r.json --format jsonl -o e.jsonl",
          "export r.json --format google-benchmark -o e.json", "export r.json --format junit -o e.xml"})
      EXPECT_EQ(run(command), 0) << command << ": " << read("err");
  EXPECT_EQ(run("prove ratio --medium linear --quick -o other.json"), static_cast<int>(ExitCode::input_error));
  EXPECT_EQ(read("err"), "nullmark: other.json: exists; --force replaces it\n");
  EXPECT_EQ(read("other.json"), kept);
}

/// What is larger than any configuration is refused before it is parsed.
TEST_F(HostileFiles, ConfigurationsAreNoLargerThanTheirCellsNeed) {
  const std::string whole = config(R"("linear")", R"("samples_per_ray":1)");
  write("c.json", whole + std::string(std::size_t{65} << 20, ' '));
  EXPECT_EQ(run("run c.json --dry-run"), static_cast<int>(ExitCode::input_error));
  EXPECT_EQ(read("err"), "nullmark: c.json: holds more than 64 MiB; expected a configuration\n");
  EXPECT_EQ(run("run - --dry-run", NULLMARK_PROGRAM, "c.json"), static_cast<int>(ExitCode::input_error));
  EXPECT_EQ(read("err"), "nullmark: <stdin>: holds more than 64 MiB; expected a configuration\n");
}

/// To a pipe that has a name nobody may ever write.
TEST_F(HostileFiles, PipesWithoutAWriterEndAtOnce) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const char* command : {"check pipe", "run pipe -o q.json"}) {
    EXPECT_EQ(run(fmt::format("{}", command)), static_cast<int>(ExitCode::input_error)) << command;
    EXPECT_NE(read("err").find("pipe:1:1: is empty"), std::string::npos) << read("err");
  }
}

/// Root may read everything, so the program runs without that right.
TEST_F(HostileFiles, WhatMayNotBeReadIsRefusedInOneLine) {
  write("v.vdb", "a volume");
  write("c.json", config(R"({"type":"vdb","file":"v.vdb"})", R"("samples_per_ray":1)"));
  std::filesystem::permissions(folder_ / "v.vdb", std::filesystem::perms::none);
  const bool root = ::geteuid() == 0;
  if (root && std::system("setpriv --bounding-set=-all --inh-caps=-all true 2>/dev/null") != 0)
    GTEST_SKIP() << "root reads everything, and setpriv is missing";
  const std::string as_other = root ? "setpriv --bounding-set=-all --inh-caps=-all " : "";
  const std::string command =
      fmt::format("cd '{}' && {}'{}' run c.json -o r.json >out 2>err </dev/null", folder_.string(), as_other, NULLMARK_PROGRAM);
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), static_cast<int>(ExitCode::input_error));
  const std::string error = read("err");
  EXPECT_NE(error.find("v.vdb"), std::string::npos) << error;
  EXPECT_NE(error.find("cannot be read: Permission denied"), std::string::npos) << error;
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
}

TEST_F(HostileFiles, LinksToResultsStayLinks) {
  std::filesystem::create_directories(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere/r.json") << "old";
  std::filesystem::create_symlink("elsewhere/r.json", folder_ / "link.json");
  write_atomically((folder_ / "link.json").string(), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link.json"));
  EXPECT_EQ(read("elsewhere/r.json"), "new");
}

TEST_F(HostileFiles, LeftoversOfTheDeadAreRemovedAndNoOthers) {
  const std::string live = "r.json." + std::to_string(::getpid()) + ".tmp";
  for (const std::string& name :
       {std::string("r.json.2147483646.tmp"), std::string("r.json.notes.tmp"), live, std::string("s.json.2147483646.tmp")})
    write(name, "half");
  remove_leftovers((folder_ / "r.json").string());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "r.json.2147483646.tmp"));
  for (const std::string& name : {std::string("r.json.notes.tmp"), live, std::string("s.json.2147483646.tmp")})
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
}

}  // namespace
}  // namespace nullmark
