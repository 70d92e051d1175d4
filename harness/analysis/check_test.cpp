// What `check` makes of a run whose cells are good each on its own.

#include "harness/analysis/check.h"

#include <gtest/gtest.h>

#include "harness/report/check_text.h"
#include "harness/report/junit.h"
#include "harness/testing/program.h"
#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

CellRecord of_tracker(CellRecord record, const std::string& tracker, const std::string& claims = "unbiased") {
  record.cell.estimator = Component{tracker, {}, tracker, ""};
  record.claims = claims;
  return record;
}

Summary summary_of(std::vector<CellRecord> cells, bool strict = false) {
  RunRecord run = run_of(std::move(cells));
  return summarise(run, strict);
}

std::string text_of(std::vector<CellRecord> cells, bool strict = false) {
  RunRecord run = run_of(std::move(cells));
  return summary_text(run, summarise(run, strict));
}

/// Cells of a march of order 1, whose fit passes.
std::vector<CellRecord> marches() {
  std::vector<CellRecord> cells;
  for (const int steps : {8, 16, 32}) {
    CellRecord record = of_tracker(passed_by_own_mean(), "ray_marching", "consistent");
    record.cell.estimator.edit([&](Component& estimator) { estimator.values = {{"steps", steps}}; });
    record.order = 1;
    record.channel.at(0).reference = 0.5;
    record.channel[0].reference_error = 1e-12;
    record.channel[0].bias = 0.5 * std::expm1(0.1 / steps);
    record.channel[0].variance_theory = 0;
    cells.push_back(record);
  }
  return cells;
}

TEST(SummaryOfOwnMeans, ProveNothingOfTheQuantity) {
  const CellRecord own = of_tracker(passed_by_own_mean(), "march", "consistent");
  const Summary summary = summary_of({own, own});
  EXPECT_EQ(summary.pass, 2u);
  EXPECT_EQ(summary.own_mean, 2u);
  EXPECT_EQ(summary.exit, ExitCode::inconclusive);
  EXPECT_NE(text_of({own, own}).find("no cell proves anything about the quantity itself"), std::string::npos);
  EXPECT_NE(text_of({own, own}).find("2 PASS (of them 2 own mean), 0 FAIL"), std::string::npos);
  EXPECT_EQ(summary_of({own, passed()}).exit, ExitCode::ok);
  EXPECT_EQ(summary_of({own, failed()}).exit, ExitCode::bias_proven);
  EXPECT_EQ(summary_of(marches()).exit, ExitCode::ok) << "an order is a property of the quantity's estimate";
}

TEST(SummaryOfOrders, TheFirstLineCountsThoseThatFailed) {
  std::vector<CellRecord> cells = marches();
  EXPECT_EQ(text_of(cells).find("ORDER FAIL"), std::string::npos);
  for (CellRecord& cell : cells) cell.order = 2;
  EXPECT_EQ(summary_of(cells).exit, ExitCode::bias_proven);
  const std::string text = text_of(cells), first = text.substr(0, text.find('\n'));
  EXPECT_NE(first.find(", 1 ORDER FAIL"), std::string::npos) << first;
}

TEST(SummaryOfTrackers, EachThatClaimsMustBeDecidedSomewhere) {
  const CellRecord good = of_tracker(passed(), "ratio"), other = of_tracker(open_as_planned(), "roulette_ratio/share:0.5");
  EXPECT_EQ(summary_of({good, other}).exit, ExitCode::inconclusive);
  EXPECT_NE(text_of({good, other}).find("roulette_ratio/share:0.5 claims unbiased and no cell decides it\n"), std::string::npos);
  const CellRecord decided = of_tracker(passed(), "roulette_ratio/share:0.5");
  EXPECT_EQ(summary_of({good, other, decided}).exit, ExitCode::ok);
  EXPECT_TRUE(summary_of({good, other, decided}).undecided_trackers.empty());
  // Laws that hold decide no mean.
  CellRecord lawful = other;
  lawful.verdict->laws = {{"independence", 0, 100, Outcome::none}};
  decide(*lawful.verdict);
  EXPECT_EQ(summary_of({good, lawful}).exit, ExitCode::inconclusive);
  EXPECT_EQ(summary_of({good, of_tracker(violated(), "delta")}).undecided_trackers,
            std::vector<std::string>{"delta claims unbiased and no cell decides it"});
  EXPECT_EQ(summary_of({good, of_tracker(passed_by_own_mean(), "march", "consistent")}).exit, ExitCode::ok);
  EXPECT_EQ(summary_of({failed(), other}).exit, ExitCode::bias_proven) << "what is proven comes first";
}

TEST(SummaryOfTrackers, ThoseThatWereNotAskedAreNotMissed) {
  const CellRecord good = of_tracker(passed(), "ratio");
  for (const CellRecord& other : {unsampled(of_tracker(passed(), "delta"), Status::skipped, "does not apply"),
                                  of_tracker(unjudged("the configuration disables the verdict"), "delta"),
                                  of_tracker(open_as_planned(), "delta", "biased")})
    EXPECT_EQ(summary_of({good, other}).exit, ExitCode::ok) << other.reason;
}

TEST(SummaryStrict, EveryClaimMustBeDecided) {
  const CellRecord skipped = unsampled(passed(), Status::skipped, "no data");
  for (const CellRecord& record : {open_as_planned(), violated(), skipped}) {
    EXPECT_EQ(summary_of({passed(), record}).exit, ExitCode::ok);
    EXPECT_EQ(summary_of({passed(), record}, true).exit, ExitCode::inconclusive);
    EXPECT_NE(text_of({passed(), record}, true).find("--strict: 1 cells that claim something are not decided"),
              std::string::npos);
  }
  EXPECT_EQ(summary_of({passed(), unjudged("nothing was tested")}, true).exit, ExitCode::ok);
  EXPECT_EQ(summary_of({passed(), of_tracker(skipped, "march", "biased")}, true).exit, ExitCode::ok);
  EXPECT_EQ(summary_of({passed(), of_tracker(passed_by_own_mean(), "march", "consistent")}, true).exit, ExitCode::ok);
  EXPECT_EQ(summary_of({open_as_planned(), failed()}, true).exit, ExitCode::bias_proven);
}

/// One cell that passed, and a required claim that its variance, which is 1 and known to a few per cent, is at most a number.
RunRecord with_claim(Real at_most) {
  RunRecord run = run_of({passed()});
  CellRecord& record = run.cells[0];
  record.samples = 100'000;
  record.channel[0].variance = 1;
  record.channel[0].kurtosis = 3;
  ClaimPart part;
  part.says = "of the first cell";
  part.metric = "variance";
  part.cells = {record.cell.name};
  part.relation = Relation::at_most;
  part.numbers = {at_most};
  run.claims = {{"C", "a paper", "It varies so much.", "", {part}, true}};
  return run;
}

TEST(CheckOfRequiredClaims, TheirOutcomeIsThatOfTheRun) {
  struct Case {
    Real at_most;
    ExitCode required;
    std::string line, test;
  };
  for (const Case& one : {Case{2, ExitCode::ok, "", "<testcase classname=\"required claim\" name=\"C: It varies so much.\"/>"},
                          Case{0.5, ExitCode::bias_proven, "required claim C is refuted: of the first cell: variance 1 +- ",
                               "<failure message=\"refuted: of the first cell: variance 1 +- "},
                          Case{1, ExitCode::inconclusive, "required claim C cannot be told: of the first cell: variance 1 +- ",
                               "<skipped message=\"cannot tell: of the first cell: variance 1 +- "}}) {
    RunRecord run = with_claim(one.at_most);
    const Summary summary = summarise(run);
    EXPECT_EQ(summary.exit, one.required) << one.at_most;
    const std::string text = summary_text(run, summary), markdown = summary_markdown(run, summary, "r.json"),
                      xml = junit(run, "r");
    EXPECT_NE(text.find(one.line), std::string::npos) << text;
    EXPECT_NE(text.find(" (required): It varies so much."), std::string::npos) << text;
    EXPECT_NE(markdown.find(one.line), std::string::npos) << markdown;
    EXPECT_NE(xml.find(one.test), std::string::npos) << xml;
    EXPECT_NE(xml.find("tests=\"2\""), std::string::npos) << xml;

    run.claims[0].required = false;
    const Summary without = summarise(run);
    EXPECT_EQ(without.exit, ExitCode::ok) << one.at_most;
    EXPECT_EQ(summary_text(run, without).find("required"), std::string::npos);
    EXPECT_NE(junit(run, "r").find("tests=\"1\""), std::string::npos);
  }
}

TEST(CheckOfRequiredClaims, OneWithoutItsCellsIsMissed) {
  RunRecord run = with_claim(2);
  run.claims[0].parts[0].cells = {"another"};
  const Summary summary = summarise(run);
  EXPECT_EQ(summary.exit, ExitCode::inconclusive);
  EXPECT_NE(summary_text(run, summary).find("required claim C cannot be told: of the first cell: the cell was not run\n"),
            std::string::npos);
  // Nothing else was asked for.
  run.cells[0] = unjudged("the configuration disables the verdict");
  EXPECT_EQ(summarise(run).exit, ExitCode::inconclusive);
  run.claims[0].required = false;
  EXPECT_EQ(summarise(run).exit, ExitCode::nothing_ran);
}

TEST(JunitOfCells, NoVerdictIsNoPass) {
  VerdictRecord untested;
  untested.against = "reference";
  CellRecord nothing = unjudged("");
  nothing.verdict = untested;
  const std::string text =
      junit(run_of({passed(), unjudged("the configuration disables the verdict"), unjudged(""), nothing}), "r");
  EXPECT_NE(text.find(R"(tests="4" failures="0" errors="0" skipped="3")"), std::string::npos) << text;
  EXPECT_NE(text.find("<skipped message=\"not tested (claims unbiased): the configuration disables the verdict\">"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("<skipped message=\"not tested (claims unbiased): no verdict\">"), std::string::npos) << text;
  EXPECT_NE(text.find("<skipped message=\"not tested (claims unbiased): no mean was tested\">"), std::string::npos) << text;
}

class Selection : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":2000,"verdict":{"epsilon":0.5,"max_samples_per_ray":100000},
       "matrix":{"estimator":["ratio","delta"],"medium":["linear",{"type":"linear","end":2}]}}]})");
  }
  Json provenance(const std::string& file) const { return Json::parse(read(file))["provenance"]; }
};

TEST_F(Selection, AFilterIsIntent) {
  ASSERT_EQ(run("run c.json -o f.json --filter ^ratio"), 0) << read("err");
  EXPECT_EQ(provenance("f.json")["filter"], "^ratio");
  EXPECT_EQ(provenance("f.json")["selected"], 2);
  EXPECT_FALSE(provenance("f.json").contains("shard"));
  EXPECT_EQ(run("check f.json"), 0) << read("out");
  EXPECT_NE(read("out").find("2 of the configuration's 4 cells were selected by --filter \"^ratio\"\n"), std::string::npos)
      << read("out");
  EXPECT_EQ(read("out").find("never started"), std::string::npos) << read("out");
}

TEST_F(Selection, AShardIsNone) {
  ASSERT_EQ(run("run c.json -o a.json --shard 1/2"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json --shard 2/2"), 0) << read("err");
  EXPECT_EQ(provenance("a.json")["shard"], "1/2");
  EXPECT_EQ(provenance("a.json")["selected"], 4);
  EXPECT_EQ(run("check a.json"), 77);
  EXPECT_NE(read("out").find("2 cells of the configuration belong to other shards, or were never started\n"), std::string::npos)
      << read("out");
  ASSERT_EQ(run("merge a.json b.json -o m.json"), 0) << read("err");
  EXPECT_FALSE(provenance("m.json").contains("shard"));
  EXPECT_EQ(run("check m.json"), 0) << read("out");
}

TEST_F(Selection, ShardsOfAFilterAreWholeOnceMerged) {
  ASSERT_EQ(run("run c.json -o a.json --filter linear --shard 1/4"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json --filter ^ratio --shard 1/2"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o c2.json --filter ^ratio --shard 2/2"), 0) << read("err");
  EXPECT_EQ(run("check b.json"), 77) << read("out");
  ASSERT_EQ(run("merge b.json c2.json -o m.json"), 0) << read("err");
  EXPECT_EQ(provenance("m.json")["filter"], "^ratio");
  EXPECT_EQ(provenance("m.json")["selected"], 2);
  EXPECT_EQ(run("check m.json"), 0) << read("out");
  // Parts of two selections are no whole of either.
  ASSERT_EQ(run("merge a.json b.json -o n.json"), 0) << read("err");
  EXPECT_FALSE(provenance("n.json").contains("filter"));
  EXPECT_FALSE(provenance("n.json").contains("selected"));
  EXPECT_EQ(run("check n.json"), 77) << read("out");
}

TEST_F(Selection, ResumingWidensIt) {
  ASSERT_EQ(run("run c.json -o r.json --filter ^ratio"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o r.json --filter ^delta --resume"), 0) << read("err");
  EXPECT_EQ(provenance("r.json")["selected"], 4);
  EXPECT_EQ(run("check r.json"), 0) << read("out");
}

TEST_F(Selection, WhatIsNoCountOfCellsIsIgnored) {
  ASSERT_EQ(run("run c.json -o r.json --shard 1/2"), 0) << read("err");
  for (const char* hostile : {"-1", "\"two\"", "null", "[2]", "1.5"}) {
    Json json = Json::parse(read("r.json"));
    json["provenance"]["selected"] = Json::parse(hostile);
    write("h.json", json.dump());
    EXPECT_EQ(run("check h.json"), 77) << hostile;
  }
}

class CheckClaims : public ProgramTest {
 protected:
  /// The exit code of `check` for a claim on E[X] = exp(-0.5) = 0.607.
  int check_with(const std::string& claim) const {
    write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":20000,"verdict":{"epsilon":0.1},"matrix":{"estimator":"ratio","medium":"linear"}}],
      "claims":[{"id":"C","source":"theory","claim":"So it is.",)" +
                        claim + "}]}");
    EXPECT_EQ(run("run c.json -o r.json --force"), 0) << read("err");
    return run("check r.json");
  }
  static std::string part(const std::string& compared) { return R"("parts":[{"metric":"mean","cells":{},)" + compared + "}]"; }
};

TEST_F(CheckClaims, OnlyRequiredOnesDecideTheExitCode) {
  const std::string required = R"("required":true,)", reproduced = part(R"("at_least":0.5)"), refuted = part(R"("at_most":0.5)"),
                    open = part(R"("near":"theory","tolerance":1e-6)");
  EXPECT_EQ(check_with(required + reproduced), 0) << read("out");
  EXPECT_EQ(check_with(required + refuted), 3) << read("out");
  EXPECT_EQ(check_with(required + open), 77) << read("out");
  for (const std::string& other : {reproduced, refuted, open}) {
    EXPECT_EQ(check_with(other), 0) << read("out");
    EXPECT_EQ(check_with(R"("required":false,)" + other), 0) << read("out");
  }
}

class Nothing : public ProgramTest {
 protected:
  static std::string config(const std::string& gate) {
    return R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e",
      "rays":{"type":"single","from":[5,5,5],"to":[6,6,6]},"samples_per_ray":1000,)" +
           gate + R"("matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})";
  }
};

TEST_F(Nothing, RaysThatMissTheMediumTestNothing) {
  write("v.json", config(""));
  ASSERT_EQ(run("run v.json -o r.json"), 0) << read("err");
  for (const CellRecord& record : results("r.json").cells) {
    EXPECT_FALSE(record.verdict);
    EXPECT_EQ(record.reason, "no ray meets any extinction: nothing was tested; the medium's bounds are [0, 0, 0] to [1, 1, 1]");
  }
  EXPECT_EQ(run("check r.json --junit j.xml"), 5) << read("out");
  EXPECT_NE(read("out").find("0 PASS, 0 FAIL"), std::string::npos) << read("out");
  EXPECT_NE(read("out").find("2 not tested\nno cell was judged: no ray meets any extinction: nothing was tested; the medium's "
                             "bounds are [0, 0, 0] to [1, 1, 1] (2)\n"),
            std::string::npos)
      << read("out");
  EXPECT_NE(read("j.xml").find(R"(failures="0" errors="0" skipped="2")"), std::string::npos) << read("j.xml");
  EXPECT_EQ(run("run v.json --dry-run"), 0);
  EXPECT_NE(read("out").find("not judged"), std::string::npos) << read("out");
}

TEST_F(Nothing, ADisabledVerdictIsSkippedWithTheReason) {
  write("d.json", config(R"("verdict":{"enabled":false},)"));
  ASSERT_EQ(run("run d.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --junit j.xml"), 5) << read("out");
  EXPECT_NE(read("j.xml").find(R"(tests="2" failures="0" errors="0" skipped="2")"), std::string::npos) << read("j.xml");
  EXPECT_NE(read("j.xml").find("not tested (claims unbiased): the configuration disables the verdict"), std::string::npos)
      << read("j.xml");
}

/// Many cells that need no look become one line; cells that need one stay listed.
TEST(CheckText, ManyCellsThatNeedNoLookAreOneLineEach) {
  RunRecord run = example_results();
  CellRecord passed = run.cells[0];
  passed.verdict = verdict_of({passing()});
  passed.verdict->bound_unproven = true;
  CellRecord failed = passed;
  failed.verdict = verdict_of({failing()});
  decide(*passed.verdict);
  decide(*failed.verdict);
  failed.cell.name = "wrong";
  run.cells.assign(50, passed);
  run.cells.push_back(failed);
  const Summary summary = summarise(run);
  const std::string all = summary_text(run, summary), some = summary_text(run, summary, false);
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  // One line stands for 50, and one says how to see them.
  EXPECT_EQ(lines(all) - lines(some), 48);
  EXPECT_NE(some.find("PASS (bound not proven): 50 cells of ratio (50)\n"), std::string::npos) << some;
  EXPECT_NE(some.find("FAIL: wrong: "), std::string::npos) << some;
  run.cells.erase(run.cells.begin(), run.cells.begin() + 10);
  EXPECT_EQ(summary_text(run, summary, false), summary_text(run, summary));
}

}  // namespace
}  // namespace nullmark
