// Results of different builds, and of a volume that was replaced, are not joined by mistake.

#include "harness/run/build.h"

#include "harness/analysis/comparison.h"
#include "harness/model/exit_code.h"
#include "harness/run/journal.h"
#include "harness/run/merge.h"
#include "harness/testing/page_data.h"
#include "harness/testing/program.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

const std::map<std::string, std::string> kProvenance = {{"version", R"("0.1.0")"},
                                                        {"git", R"({"commit":"0123456789abcdef","dirty":false,"changes":""})"},
                                                        {"compiler", R"({"name":"gcc 12","flags":"-O3","build_type":"Release"})"},
                                                        {"libc", R"("glibc 2.36")"},
                                                        {"target", R"({"march":"x86-64-v3","simd":"AVX2"})"}};

std::map<std::string, std::string> provenance_with(const char* key, const char* text) {
  std::map<std::string, std::string> provenance = kProvenance;
  provenance[key] = text;
  return provenance;
}

constexpr const char *kOtherCommit = R"({"commit":"fedcba9876543210","dirty":false,"changes":""})",
                     *kChanged = R"({"commit":"0123456789abcdef","dirty":true,"changes":"00ff"})",
                     *kPlugin = R"({"name":"liar","version":"1","hash":"aa"})",
                     *kSamePluginOtherHash = R"({"name":"liar","version":"1","hash":"bb"})";

std::string refusal(const std::map<std::string, std::string>& found, const std::map<std::string, std::string>& expected,
                    Builds builds) {
  try {
    expect_joinable("r.json", build_of(found), "this program", build_of(expected), builds);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Builds, OtherSourcesAreNeverJoined) {
  EXPECT_EQ(refusal(kProvenance, kProvenance, Builds::same), "");
  for (const Builds builds : {Builds::same, Builds::any}) {
    EXPECT_EQ(refusal(provenance_with("git", kOtherCommit), kProvenance, builds),
              "r.json: found cells of commit fedcba9876; expected those of this program, commit 0123456789; run all cells "
              "by one build");
    EXPECT_EQ(refusal(provenance_with("git", kChanged), kProvenance, builds),
              "r.json: found cells of commit 0123456789 with changes 00ff; expected those of this program, commit "
              "0123456789; run all cells by one build");
    EXPECT_EQ(refusal(provenance_with("plugin", kPlugin), kProvenance, builds),
              "r.json: found cells of the plug-in liar 1, hash aa; expected those of this program, nullmark itself; run "
              "all cells by one build");
    EXPECT_NE(refusal(provenance_with("plugin", kPlugin), provenance_with("plugin", kSamePluginOtherHash), builds), "");
    // Of a build that did not tell its changes nobody knows whether they are the same.
    EXPECT_NE(refusal(provenance_with("git", R"({"commit":"0123456789abcdef","dirty":true})"), kProvenance, builds), "");
  }
}

TEST(Builds, OtherEnvironmentsAreJoinedWhereAskedFor) {
  for (const auto& [key, text] :
       {std::pair("compiler", R"({"name":"clang 14","flags":"-O3","build_type":"Release"})"),
        std::pair("libc", R"("glibc 2.41")"), std::pair("target", R"({"march":"native","simd":"AVX3"})")}) {
    const std::string refused = refusal(provenance_with(key, text), kProvenance, Builds::same);
    EXPECT_NE(refused.find("gcc 12 -O3 (Release), glibc 2.36, x86-64-v3 AVX2; --builds any"), std::string::npos) << refused;
    EXPECT_EQ(refusal(provenance_with(key, text), kProvenance, Builds::any), "");
  }
}

/// The second half of a run is of another C library: its cells are marked, and ranked apart.
TEST(Builds, MergedCellsAreMarkedAndRankedApart) {
  RunRecord first = example_results(), second = first;
  first.provenance = kProvenance;
  second.provenance = provenance_with("libc", R"("glibc 2.41")");
  first.cells.resize(1);
  second.cells.erase(second.cells.begin());
  const std::vector<std::string> names = {"a.json", "b.json"};
  EXPECT_THROW(merge_results({first, second}, names), InputError);
  const RunRecord merged = merge_results({first, second}, names, Builds::any);
  ASSERT_EQ(merged.cells.size(), 4u);
  EXPECT_EQ(merged.cells[0].build, "");
  for (const std::size_t i : {1, 2, 3}) EXPECT_EQ(merged.cells[i].build, "gcc 12 -O3 (Release), glibc 2.41, x86-64-v3 AVX2");
  EXPECT_EQ(statistics_text(merged), statistics_text(example_results()));
  // The mark survives the file, and goes where the cell comes home.
  const RunRecord again = read_results(results_text(merged), "m.json");
  EXPECT_EQ(again.cells[1].build, merged.cells[1].build);
  RunRecord home = second;
  home.cells.clear();
  const RunRecord turned = merge_results({home, again}, names, Builds::any);
  EXPECT_EQ(turned.cells[0].build, "gcc 12 -O3 (Release), glibc 2.36, x86-64-v3 AVX2");
  EXPECT_EQ(turned.cells[1].build, "");
  // The first two cells are rivals, but for their builds.
  const auto ranked_together = [](const RunRecord& run) {
    std::size_t most = 0;
    for (const Comparison& comparison : comparisons({run}, "")) most = std::max(most, comparison.cells.size());
    return most;
  };
  RunRecord rivals = merged;
  rivals.cells.resize(3);
  rivals.cells.erase(rivals.cells.begin() + 1);
  RunRecord unmarked = rivals;
  for (CellRecord& cell : unmarked.cells) cell.build.clear();
  EXPECT_EQ(ranked_together(unmarked), 2u);
  EXPECT_EQ(ranked_together(rivals), 1u);
}

TEST(Builds, AMergedMediumHasOneHash) {
  RunRecord first = example_results(), second = first;
  first.cells.resize(1);
  second.cells.erase(second.cells.begin());
  for (CellRecord& cell : second.cells) cell.medium_hash = "fedcba9876543210";
  try {
    merge_results({first, second}, {"a.json", "b.json"});
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("hash fedcba9876543210; expected 0123456789abcdef, as in a.json"), std::string::npos) << message;
  }
}

class BuildFiles : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":50,"verdict":{"laws":"never"},
       "matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})");
    write("v.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":50,"verdict":{"laws":"never"},
       "matrix":{"estimator":["ratio","delta"],"medium":{"type":"vdb","file":"v.vdb"}}}]})");
  }

  void replace(const std::string& name, const std::string& key, const Json& value) const {
    Json json = Json::parse(read(name));
    json["provenance"][key] = value;
    write(name, json.dump());
  }

  std::string refused(const std::string& arguments, const char* program = NULLMARK_PROGRAM) const {
    EXPECT_EQ(run(arguments, program), static_cast<int>(ExitCode::input_error)) << arguments;
    const std::string error = read("err");
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
    return error;
  }
};

TEST_F(BuildFiles, ResumeRefusesResultsOfAnotherCommit) {
  ASSERT_EQ(run("run c.json -o r.json --filter ratio"), 0) << read("err");
  Json git = Json::parse(read("r.json"))["provenance"]["git"];
  const std::string here = git["commit"];
  git["commit"] = "fedcba98765432100000";
  replace("r.json", "git", git);
  const std::string before = read("r.json"), error = refused("run c.json -o r.json --resume");
  EXPECT_NE(error.find("commit fedcba9876"), std::string::npos) << error;
  EXPECT_NE(error.find(here.substr(0, 10)), std::string::npos) << error;
  EXPECT_EQ(read("r.json"), before);
  refused("run c.json -o r.json --resume --builds any");
  refused("run c.json -o r.json --resume --builds some");
  ASSERT_EQ(run("run c.json -o s.json --filter delta"), 0) << read("err");
  refused("merge r.json s.json -o m.json --builds any");
}

TEST_F(BuildFiles, ResumeMarksCellsOfAnotherCLibraryWhereAsked) {
  ASSERT_EQ(run("run c.json -o r.json --filter ratio"), 0) << read("err");
  replace("r.json", "libc", "glibc 9.9");
  const std::string error = refused("run c.json -o r.json --resume");
  EXPECT_NE(error.find("glibc 9.9"), std::string::npos) << error;
  ASSERT_EQ(run("run c.json -o r.json --resume --builds any"), 0) << read("err");
  const RunRecord joined = results("r.json");
  ASSERT_EQ(joined.cells.size(), 2u);
  EXPECT_NE(joined.cells[0].build.find("glibc 9.9"), std::string::npos);
  EXPECT_EQ(joined.cells[1].build, "");
  EXPECT_EQ(run("compare r.json"), 0);
  EXPECT_NE(read("out").find("glibc 9.9"), std::string::npos) << read("out");
}

TEST_F(BuildFiles, JournalsTellTheBuildOfTheirCells) {
  const RunRecord example = example_results();
  const std::string path = (folder_ / "r.json").string();
  const Build first = build_of(kProvenance), second = build_of(provenance_with("libc", R"("glibc 2.41")"));
  using Mode = Journal::Mode;
  { Journal(path, "hash", Mode::fresh, first).append(example.cells[0]); }
  EXPECT_THROW(Journal(path, "hash", Mode::resume, second), InputError);
  EXPECT_THROW(Journal(path, "hash", Mode::resume, build_of(provenance_with("git", kOtherCommit)), Builds::any), InputError);
  { Journal(path, "hash", Mode::resume, second, Builds::any).append(example.cells[1]); }
  for (const auto& [build, marked] : {std::pair(first, 1u), std::pair(second, 0u)}) {
    const Journal journal(path, "hash", Mode::resume, build, Builds::any);
    ASSERT_EQ(journal.cells().size(), 2u);
    EXPECT_NE(journal.cells()[marked].build, "");
    EXPECT_EQ(journal.cells()[1 - marked].build, "");
  }
}

TEST_F(BuildFiles, AVolumeThatWasReplacedIsNotResumedOrMerged) {
  ASSERT_EQ(run("make-volume v.vdb --resolution 16 --seed 1"), 0) << read("err");
  ASSERT_EQ(run("run v.json -o a.json --filter ratio"), 0) << read("err");
  ASSERT_EQ(run("run v.json -o whole.json --filter ratio --resume"), 0) << read("err");
  ASSERT_EQ(run("make-volume v.vdb --resolution 16 --seed 2 --force"), 0) << read("err");
  ASSERT_EQ(run("run v.json -o b.json --filter delta"), 0) << read("err");
  const std::string one = results("a.json").cells[0].medium_hash, other = results("b.json").cells[0].medium_hash;
  ASSERT_NE(one, other);
  for (const char* command : {"run v.json -o a.json --resume", "merge a.json b.json -o m.json"}) {
    const std::string error = refused(command);
    for (const std::string& hash : {one, other}) EXPECT_NE(error.find(hash), std::string::npos) << error;
  }
  EXPECT_EQ(results("a.json").cells.size(), 1u);
}

TEST_F(BuildFiles, APlugInStatesItself) {
  ASSERT_EQ(run("run c.json -o own.json --filter ratio"), 0) << read("err");
  EXPECT_FALSE(Json::parse(read("own.json"))["provenance"].contains("plugin"));
  ASSERT_EQ(run("run c.json -o r.json --filter ratio", NULLMARK_FAULTY_PROGRAM), 0) << read("err");
  const Json plugin = Json::parse(read("r.json"))["provenance"]["plugin"];
  EXPECT_EQ(plugin["name"], "faulty");
  EXPECT_EQ(plugin["version"], "7");
  EXPECT_EQ(plugin["hash"].get<std::string>().size(), 16u);
  const std::string error = refused("run c.json -o own.json --resume", NULLMARK_FAULTY_PROGRAM);
  EXPECT_NE(error.find("nullmark itself"), std::string::npos) << error;
  EXPECT_NE(error.find("the plug-in faulty 7"), std::string::npos) << error;
  EXPECT_EQ(run("run c.json -o r.json --resume", NULLMARK_FAULTY_PROGRAM), 0) << read("err");
  ASSERT_EQ(run("report r.json -o page.html", NULLMARK_FAULTY_PROGRAM), 0) << read("err");
  EXPECT_NE(data_of_page(read("page.html")).find("nullmark_faulty check r.json"), std::string::npos);
}

}  // namespace
}  // namespace nullmark
