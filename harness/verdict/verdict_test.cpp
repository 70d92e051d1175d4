// From figures to verdicts, from verdicts to the results file and back, and what `check` makes of them.

#include "harness/verdict/verdict.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "estimators/planted/scenes.h"
#include "harness/analysis/check.h"
#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/io/verdict_json.h"
#include "harness/model/exit_code.h"
#include "harness/report/check_text.h"
#include "harness/report/junit.h"
#include "harness/testing/program.h"
#include "harness/testing/record_examples.h"
#include "harness/verdict/convergence_order.h"

namespace nullmark {
namespace {

constexpr Real kAlpha = 1e-4, kAlphaPass = 1e-3;
const Real kNeeded = -std::log(kAlphaPass);

/// Of a cell with this test alone.
Outcome decide(const TestRecord& test, Real alpha_fail, Real alpha_pass) {
  const Proof proof = proven(test, alpha_fail, alpha_pass);
  if (proof.biased) return Outcome::fail;
  return proof.within ? Outcome::pass : Outcome::inconclusive;
}

TestRecord passing(int channel = 0) {
  TestRecord test;
  test.channel = channel;
  test.samples = 1000;
  test.epsilon = 0.01;
  test.reference_error = 1e-9;
  test.variance = 0.25;
  test.basis = "betting";
  test.log_e_fail = -3;
  test.log_e_low = kNeeded + 1;
  test.log_e_high = kNeeded + 2;
  test.planned = 800;
  test.rates = {0.1, 0.2};
  return test;
}

TestRecord open_one(int channel = 0) {
  TestRecord test = passing(channel);
  test.log_e_low = 0;
  return test;
}

TestRecord failing(int channel = 0) {
  TestRecord test = passing(channel);
  test.log_e_fail = 100;
  return test;
}

TestRecord deterministic(Real largest_error, int channel = 0) {
  TestRecord test = passing(channel);
  test.basis = "deterministic";
  test.log_e_fail = test.log_e_low = test.log_e_high = 0;
  test.rates.clear();
  test.planned = 0;
  test.largest_error = largest_error;
  test.rounding = 1e-13;
  test.reference_error = 1e-12;
  return test;
}

VerdictRecord verdict_of(std::vector<TestRecord> tests) {
  VerdictRecord verdict;
  verdict.against = "reference";
  verdict.variance_basis = "analytic";
  verdict.samples_per_ray = 1000;
  verdict.planned = 800;
  verdict.affordable = 4000;
  verdict.alpha = kAlpha;
  verdict.alpha_pass = kAlphaPass;
  verdict.tests = std::move(tests);
  return verdict;
}

Outcome decided(VerdictRecord verdict) {
  decide(verdict);
  return verdict.unbiased;
}

Real just_below(Real x) { return std::nextafter(x, -kInfinity); }

TEST(Verdict, ThresholdsAreTheLevels) {
  TestRecord test = passing();
  const Real proof = -std::log(kAlpha);
  test.log_e_fail = proof;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  test.log_e_fail = just_below(proof);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.log_e_low = test.log_e_high = kNeeded;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.log_e_low = just_below(kNeeded);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
  test.log_e_low = 100;
  test.log_e_high = just_below(kNeeded);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
}

TEST(Verdict, EvidenceThatIsNoNumberProvesNothing) {
  for (const Real nothing : {-kInfinity, std::numeric_limits<Real>::quiet_NaN()})
    for (Real TestRecord::*figure : {&TestRecord::log_e_low, &TestRecord::log_e_high}) {
      TestRecord test = passing();
      test.*figure = nothing;
      EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
    }
  EXPECT_EQ(decide(deterministic(std::numeric_limits<Real>::quiet_NaN()), kAlpha, kAlphaPass), Outcome::fail);
}

TEST(Verdict, AReferenceTooCoarseProvesNothing) {
  TestRecord test = passing();
  test.reference_error = 0.25 * test.epsilon;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.reference_error = 0.26 * test.epsilon;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
  test.log_e_fail = 100;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  // Samples that are all the same as well.
  test = deterministic(0.005);
  test.reference_error = 0.006;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
}

TEST(Verdict, WithoutVarianceEverySampleMustBeRight) {
  TestRecord test = deterministic(0);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.largest_error = test.rounding + test.reference_error;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.largest_error = std::nextafter(test.largest_error, 1);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  // Bets were not placed, so they say nothing.
  test.largest_error = 0;
  test.log_e_fail = 1000;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
}

TEST(Verdict, LevelsAreSharedOutOverTheFamily) {
  VerdictRecord verdict = verdict_of({passing()});
  verdict.tests[0].log_e_fail = -std::log(kAlpha);
  EXPECT_EQ(decided(verdict), Outcome::fail);
  verdict.family = 2;
  EXPECT_EQ(decided(verdict), Outcome::pass);
  verdict.tests[0].log_e_fail = -std::log(kAlpha / 2);
  EXPECT_EQ(decided(verdict), Outcome::fail);
  // PASS needs every test, so it needs no correction.
  verdict = verdict_of({passing(), passing(1)});
  verdict.family = 1'000'000;
  EXPECT_EQ(decided(verdict), Outcome::pass);
  // Lookups are a family of their own.
  verdict = verdict_of({passing(), passing(-1)});
  verdict.family = 1'000'000;
  verdict.tests[1].log_e_fail = -std::log(kAlpha);
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::pass);
  EXPECT_EQ(verdict.lookups, Outcome::fail);
}

TEST(Verdict, TheWorstTestDecides) {
  EXPECT_EQ(decided(verdict_of({})), Outcome::none);
  EXPECT_EQ(decided(verdict_of({passing(-1)})), Outcome::none);
  EXPECT_EQ(decided(verdict_of({passing(), passing(1)})), Outcome::pass);
  EXPECT_EQ(decided(verdict_of({passing(), open_one(1)})), Outcome::inconclusive);
  EXPECT_EQ(decided(verdict_of({open_one(), failing(1)})), Outcome::fail);
  EXPECT_EQ(decided(verdict_of({deterministic(0), open_one(1)})), Outcome::inconclusive);
  EXPECT_EQ(decided(verdict_of({deterministic(1), passing(1)})), Outcome::fail);
  TestRecord group = failing();
  group.group = 7;
  VerdictRecord verdict = verdict_of({passing(), group});
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::fail);
  EXPECT_NE(verdict.reason.find("ray group 7"), std::string::npos) << verdict.reason;
}

TEST(Verdict, ReasonsAreGivenAndForgotten) {
  VerdictRecord verdict = verdict_of({open_one(2)});
  decide(verdict);
  EXPECT_EQ(verdict.reason, "undecided after 1000 samples a ray; 800 were planned");
  verdict.tests = {passing()};
  decide(verdict);
  EXPECT_EQ(verdict.reason, "");
  // The plan's own reason stands.
  verdict = verdict_of({open_one()});
  verdict.planned_undecidable = true;
  verdict.reason = "too deep";
  EXPECT_EQ(decided(verdict), Outcome::inconclusive);
  decide(verdict);
  EXPECT_EQ(verdict.reason, "too deep");
}

TEST(Verdict, ViolationsAndImpossibleSamplesComeFirst) {
  VerdictRecord verdict = verdict_of({passing()});
  verdict.out_of_range = 1;
  EXPECT_EQ(decided(verdict), Outcome::fail);
  verdict.out_of_range = 0;
  verdict.nonfinite = 1;
  EXPECT_EQ(decided(verdict), Outcome::fail);
  verdict.violated = true;
  EXPECT_EQ(decided(verdict), Outcome::violated);
  // Without a true majorant a bias is no fault.
  verdict = verdict_of({failing()});
  verdict.violated = true;
  EXPECT_EQ(decided(verdict), Outcome::violated);
}

TEST(Verdict, AnEstimatorThatPredictsItsBiasIsNeverCalledUnbiased) {
  for (TestRecord test : {passing(), open_one(), failing()}) {
    VerdictRecord verdict = verdict_of({test});
    verdict.against = "own mean";
    verdict.unbiased = Outcome::pass;  // as a file may falsely say
    decide(verdict);
    EXPECT_EQ(verdict.unbiased, Outcome::none);
    EXPECT_EQ(verdict.own_mean, decided(verdict_of({test})));
    EXPECT_TRUE(verdict_json(verdict)["unbiased"].is_null());
  }
}

VerdictRecord read_back(const VerdictRecord& verdict) {
  const Json json = parse_json(verdict_json(verdict).dump(), "v.json");
  return read_verdict(JsonNode(json, "v.json"));
}

TEST(VerdictJson, ComesBackAndIsDecidedTheSame) {
  std::vector<TestRecord> grouped = {passing()};
  for (int g = 0; g < 16; ++g) {
    TestRecord group = g == 3 ? open_one() : passing();
    group.group = g;
    group.epsilon = 0.04;
    group.log_e_fail = -1.25 * g;
    group.reference_error = 1e-10 * (g + 1);
    grouped.push_back(group);
  }
  std::vector<TestRecord> mixed = grouped;
  mixed[5] = deterministic(2e-13);
  mixed[5].group = 4;
  mixed[5].epsilon = 0.04;
  mixed.push_back(passing(1));
  mixed.push_back(failing(-1));
  TestRecord no_evidence = passing();
  no_evidence.log_e_low = -kInfinity;
  VerdictRecord violated = verdict_of({failing()});
  violated.violated = true;
  VerdictRecord own = verdict_of({passing()});
  own.against = "own mean";
  VerdictRecord broken = verdict_of({passing()});
  broken.nonfinite = 3;
  broken.out_of_range = 5;
  broken.family = 9007199254740993;
  for (VerdictRecord verdict : {verdict_of({passing()}), verdict_of({open_one(), passing(-1)}), verdict_of({failing()}),
                                verdict_of({deterministic(0)}), verdict_of({deterministic(kInfinity)}), verdict_of(grouped),
                                verdict_of(mixed), verdict_of({no_evidence}), violated, own, broken, verdict_of({})}) {
    decide(verdict);
    VerdictRecord back = read_back(verdict);
    EXPECT_EQ(verdict_json(back), verdict_json(verdict));
    ASSERT_EQ(back.tests.size(), verdict.tests.size());
    decide(back);
    EXPECT_EQ(verdict_json(back), verdict_json(verdict));
    for (std::size_t i = 0; i < back.tests.size(); ++i) {
      EXPECT_EQ(back.tests[i].outcome, verdict.tests[i].outcome) << i;
      EXPECT_EQ(back.tests[i].group, verdict.tests[i].group);
      EXPECT_EQ(back.tests[i].channel, verdict.tests[i].channel);
      EXPECT_EQ(back.tests[i].log_e_fail, verdict.tests[i].log_e_fail);
      EXPECT_EQ(back.tests[i].log_e_low, verdict.tests[i].log_e_low);
      EXPECT_EQ(back.tests[i].reference_error, verdict.tests[i].reference_error);
    }
  }
}

TEST(VerdictJson, RefusesWhatIsNoVerdict) {
  VerdictRecord verdict = verdict_of({passing(), passing()});
  verdict.tests[1].group = 0;
  const Json good = verdict_json(verdict);
  const auto refused = [](const Json& json) {
    try {
      read_verdict(JsonNode(json, "v.json"));
      return std::string();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refused(good), "");
  for (const auto& [key, value] : {std::pair<std::string, Json>{"unbiased", "FINE"},
                                   {"alpha", 0},
                                   {"alpha_pass", 1},
                                   {"family", 0},
                                   {"against", "nothing"},
                                   {"violated", 1}}) {
    Json bad = good;
    bad[key] = value;
    EXPECT_NE(refused(bad).find(key), std::string::npos) << key << ": " << refused(bad);
  }
  Json short_list = good;
  short_list["tests"][0]["groups"]["log_e_low"] = Json::array();
  EXPECT_NE(refused(short_list).find("log_e_low"), std::string::npos);
}

CellRecord judged(VerdictRecord verdict) {
  CellRecord record = example_results().cells[0];
  decide(verdict);
  record.verdict = verdict;
  return record;
}

RunRecord run_of(std::vector<CellRecord> cells) {
  RunRecord run;
  run.cells = std::move(cells);
  return run;
}

ExitCode exit_of(std::vector<CellRecord> cells) {
  RunRecord run = run_of(std::move(cells));
  return summarise(run).exit;
}

TEST(Summary, ExitCodes) {
  const CellRecord pass = judged(verdict_of({passing()})), fail = judged(verdict_of({failing()}));
  const CellRecord open = judged(verdict_of({open_one()}));
  VerdictRecord deep = verdict_of({open_one()});
  deep.planned_undecidable = true;
  const CellRecord expected = judged(deep);
  VerdictRecord lookups = verdict_of({passing(), failing(-1)});
  VerdictRecord without_bound = verdict_of({failing()});
  without_bound.violated = true;
  const CellRecord violated = judged(without_bound);
  const CellRecord error = unsampled(pass, Status::error, "crashed"), skipped = unsampled(pass, Status::skipped, "no data");
  CellRecord unclaimed = pass;
  unclaimed.verdict.reset();

  EXPECT_EQ(exit_of({pass}), ExitCode::ok);
  EXPECT_EQ(exit_of({pass, expected, violated, skipped, unclaimed}), ExitCode::ok);
  EXPECT_EQ(exit_of({pass, open}), ExitCode::inconclusive);
  EXPECT_EQ(exit_of({expected}), ExitCode::inconclusive);
  EXPECT_EQ(exit_of({pass, open, error}), ExitCode::internal_error);
  EXPECT_EQ(exit_of({pass, open, error, fail}), ExitCode::bias_proven);
  EXPECT_EQ(exit_of({pass, judged(lookups)}), ExitCode::bias_proven);
  EXPECT_EQ(exit_of({skipped, unclaimed}), ExitCode::nothing_ran);
  EXPECT_EQ(exit_of({}), ExitCode::nothing_ran);
}

TEST(Summary, NoticesVerdictsThatItsFiguresDoNotBearOut) {
  CellRecord record = judged(verdict_of({open_one()}));
  record.verdict->unbiased = Outcome::pass;
  RunRecord run = run_of({record});
  Summary summary = summarise(run);
  EXPECT_EQ(summary.altered, 1u);
  EXPECT_EQ(summary.exit, ExitCode::internal_error);
  EXPECT_EQ(run.cells[0].verdict->unbiased, Outcome::inconclusive);

  VerdictRecord own = verdict_of({passing()});
  own.against = "own mean";
  record = judged(own);
  record.verdict->unbiased = Outcome::pass;
  run = run_of({record});
  EXPECT_EQ(summarise(run).altered, 1u) << "no own mean makes an estimator unbiased";

  record = judged(verdict_of({failing()}));
  record.verdict->unbiased = Outcome::pass;
  EXPECT_EQ(exit_of({record}), ExitCode::bias_proven);
}

TEST(Summary, JunitAndMarkdownTellEveryEndOfACell) {
  VerdictRecord own = verdict_of({failing()});
  own.against = "own mean";
  own.violated = true;
  RunRecord run = run_of({judged(verdict_of({passing()})), judged(verdict_of({failing()})), judged(verdict_of({open_one()})),
                          judged(verdict_of({passing(), failing(-1)})), judged(own)});
  const char* names[] = {"good", "a<b & \"c\"", "open", "costly", "violating"};
  for (std::size_t i = 0; i < run.cells.size(); ++i) run.cells[i].cell.name = names[i];
  const Summary summary = summarise(run);
  const std::string xml = junit(run, "it's.json");
  EXPECT_NE(xml.find(R"(tests="5" failures="2" errors="0" skipped="2")"), std::string::npos) << xml;
  EXPECT_NE(xml.find(R"(name="a&lt;b &amp; &quot;c&quot;">)"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<failure message=\"FAIL: mean 0, expected 0: +0; biased, proven (log E 100.0 &gt; 9.2)"), std::string::npos)
      << xml;
  EXPECT_NE(xml.find("<failure message=\"FAIL: lookups"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<skipped message=\"INCONCLUSIVE: undecided"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<skipped message=\"VIOLATED"), std::string::npos) << xml;
  EXPECT_NE(xml.find(R"(jq .config 'it'\''s.json' | nullmark run - -o - --filter '^open$')"), std::string::npos) << xml;
  const std::string markdown = summary_markdown(run, summary, "r.json");
  for (const char* row :
       {"| FAIL | a<b & \"c\" | mean 0, expected 0: +0; biased, proven (log E 100.0", "| FAIL | costly | lookups differ",
        "| INCONCLUSIVE | open | undecided", "| VIOLATED | violating |", "--filter '^costly$'"})
    EXPECT_NE(markdown.find(row), std::string::npos) << row << "\n" << markdown;
  EXPECT_EQ(markdown.find("good"), std::string::npos);
  EXPECT_NE(summary_text(run, summary).find("1 PASS, 2 FAIL, 0 INCONCLUSIVE as planned, 1 INCONCLUSIVE, 1 VIOLATED"),
            std::string::npos);
}

/// Cells of a march with the given error of the optical depth at every step count.
std::vector<CellRecord> marches(const std::vector<std::pair<int, Real>>& biases, Real claimed, Real variance = 0) {
  std::vector<CellRecord> cells;
  for (const auto& [steps, bias] : biases) {
    CellRecord record = example_results().cells[0];
    record.cell.estimator.type = "ray_marching";
    record.cell.estimator.values = {{"steps", steps}, {"offset", std::string("left")}};
    record.claims = "consistent";
    record.order = claimed;
    record.samples = 1'000'000;
    ChannelRecord& channel = record.channel.at(0);
    channel.reference = 0.5;
    channel.reference_error = 1e-12;
    channel.bias = 0.5 * std::expm1(bias);
    channel.variance_theory = variance;
    cells.push_back(record);
  }
  return cells;
}

std::vector<std::pair<int, Real>> power(Real order, Real first, Real ripple = 0) {
  std::vector<std::pair<int, Real>> biases;
  for (const int steps : {8, 16, 32, 64})
    biases.emplace_back(steps, first * std::pow(8. / steps, order) * (1 + ripple * (steps == 16 ? -1 : 1)));
  return biases;
}

OrderFit fitted(const std::vector<CellRecord>& cells) {
  const std::vector<OrderFit> fits = fit_orders(cells);
  EXPECT_EQ(fits.size(), 1u);
  return fits.at(0);
}

TEST(Order, ExactPowersAreMeasured) {
  for (const Real order : {1., 2., 3.}) {
    const OrderFit fit = fitted(marches(power(order, -0.01), order));
    EXPECT_EQ(fit.outcome, Outcome::pass);
    EXPECT_NEAR(fit.order, order, 1e-9);
    EXPECT_EQ(fit.steps, (std::vector<int>{8, 16, 32, 64}));
    EXPECT_EQ(fitted(marches(power(order + 1, 0.01), order)).outcome, Outcome::pass) << "better than claimed is no fault";
  }
}

TEST(Order, LessThanClaimedFails) {
  const OrderFit fit = fitted(marches(power(1, 0.01), 2));
  EXPECT_EQ(fit.outcome, Outcome::fail);
  EXPECT_NEAR(fit.order, 1, 1e-9);
  EXPECT_EQ(exit_of(marches(power(1, 0.01), 2)), ExitCode::bias_proven);
  // Nearly an exact power: the first terms of an expansion.
  EXPECT_EQ(fitted(marches(power(1, 0.01, 0.01), 2)).outcome, Outcome::fail);
  EXPECT_EQ(fitted(marches(power(1, 0.01, 0.01), 1)).outcome, Outcome::pass);
}

TEST(Order, IsNotResolvedByNoise) {
  // Standard errors of 2e-3: the biases .02, .005, ... of order 2 stand out once.
  const OrderFit fit = fitted(marches(power(2, 0.02), 2, 1));
  EXPECT_EQ(fit.outcome, Outcome::inconclusive);
  EXPECT_NE(fit.reason.find("1 of 4"), std::string::npos) << fit.reason;
  EXPECT_EQ(fitted(marches(power(2, 1e-13), 2)).outcome, Outcome::inconclusive) << "no bias beyond the reference's error";
  // Three points that stand out barely: a wide interval, which holds both the claim and less.
  EXPECT_EQ(fitted(marches(power(1, 0.034), 1, 1)).outcome, Outcome::inconclusive);
  EXPECT_TRUE(fit_orders(marches({{8, 0.01}, {16, 0.005}}, 1)).empty());
}

TEST(Order, IsAClaimOfSmallSteps) {
  // On a deep medium a right-hand rule sees nothing at first, and a left-hand one many times T: orders of the optical depth.
  for (const Real depth : {-20., 20.}) EXPECT_NEAR(fitted(marches(power(1, depth), 1)).order, 1, 1e-6);
  // Steps that skip a medium's detail.
  EXPECT_EQ(fitted(marches({{1, 0.01}, {2, -0.04}, {4, 0.01}, {8, 0.02}}, 1)).outcome, Outcome::inconclusive);
  // Samples cut to 8 bits have a bias of that.
  std::vector<CellRecord> cells = marches(power(0, 0.002), 1);
  for (CellRecord& cell : cells) cell.cell.measurement.quantise_bits = 8;
  EXPECT_TRUE(fit_orders(cells).empty());
}

TEST(Order, SeriesDifferInNothingButTheirSteps) {
  std::vector<CellRecord> cells = marches(power(1, 0.01), 1);
  for (CellRecord other : marches(power(1, 0.03), 1)) {
    other.cell.estimator.values["jitter"] = 0.5;
    cells.push_back(other);
  }
  ASSERT_EQ(fit_orders(cells).size(), 2u);
  for (const OrderFit& fit : fit_orders(cells)) EXPECT_NEAR(fit.order, 1, 1e-9);
  // The same steps again resolve nothing.
  EXPECT_EQ(fitted(marches({{8, 0.01}, {8, 0.01}, {8, 0.0101}, {16, 0.01}}, 1)).outcome, Outcome::inconclusive);
  // Others claim no order.
  for (CellRecord& cell : cells) cell.claims = "unbiased";
  EXPECT_TRUE(fit_orders(cells).empty());
}

class Check : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    // All kinds of tests: channels, groups of rays, lookups, cells without variance.
    write("c.json", config(R"("rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":2000,
        "verdict":{"epsilon":0.1,"max_samples_per_ray":16000},
        "matrix":{"estimator":["ratio","delta","next_flight_ratio","regular"],
                  "medium":["linear",{"type":"homogeneous","extinction":0.5,"spectrum":[1,2,4]}],
                  "majorant":[{"type":"global","looseness":1.5}]})"));
  }

  static std::string config(const std::string& experiment) {
    return fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",{}}}]}})", experiment);
  }
};

TEST_F(Check, PassesWhatPassed) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --junit j.xml --markdown m.md"), 0) << read("out");
  EXPECT_NE(read("out").find("8 PASS, 0 FAIL"), std::string::npos) << read("out");
  EXPECT_NE(read("j.xml").find(R"(tests="8" failures="0" errors="0" skipped="0")"), std::string::npos);
  EXPECT_EQ(run("check nowhere.json"), 2);
}

TEST_F(Check, BelievesFiguresNotVerdicts) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  const Json whole = Json::parse(read("r.json"));
  const auto altered = [&](auto change) {
    Json json = whole;
    change(json["cells"][0]["verdict"]);
    write("t.json", json.dump());
    return run("check t.json");
  };
  EXPECT_EQ(altered([](Json&) {}), 0) << read("out");
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["log_e"]["low"] = 1; }), 1);
  EXPECT_NE(read("out").find("1 verdicts in the file are not what its figures say"), std::string::npos) << read("out");
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["groups"]["log_e_high"][5] = nullptr; }), 1);
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["log_e"]["fail"] = 1000; }), 3);
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["groups"]["log_e_fail"][15] = 1000; }), 3);
  EXPECT_EQ(altered([](Json& verdict) { verdict["unbiased"] = "INCONCLUSIVE"; }), 1);
  EXPECT_EQ(altered([](Json& verdict) { verdict["unbiased"] = "GREEN"; }), 2);
  EXPECT_EQ(altered([](Json& verdict) { verdict["out_of_range"] = 1; }), 3);
}

TEST_F(Check, FailsABiasedEstimatorWithWhatRepeatsIt) {
  for (const std::string_view name : {"planted_terminal_term", "planted_channel_swap"}) {
    const PlantedScene& scene = *std::find_if(std::begin(kPlantedScenes), std::end(kPlantedScenes),
                                              [&](const PlantedScene& planted) { return planted.name == name; });
    write("p.json",
          config(fmt::format(
              R"("samples_per_ray":4000,"matrix":{{"estimator":[{},"ratio"],"medium":[{}],"majorant":[{}],"rays":[{}]}})",
              scene.estimator, scene.medium, scene.majorant, scene.rays)));
    ASSERT_EQ(run("run p.json -o r.json --force", NULLMARK_PLANTED_PROGRAM), 0) << read("err");
    EXPECT_EQ(run("check r.json --junit j.xml --markdown m.md"), 3) << read("out");
    const std::string cell = results("r.json").cells.at(0).cell.name;
    EXPECT_NE(read("out").find("FAIL: " + cell), std::string::npos) << read("out");
    EXPECT_NE(read("j.xml").find("; biased beyond epsilon, proven (log E "), std::string::npos) << read("j.xml");
    EXPECT_NE(read("m.md").find("| FAIL | " + cell), std::string::npos) << read("m.md");
    const std::string command = reproduction(results("r.json").cells[0], "r.json");
    EXPECT_NE(read("m.md").find(command), std::string::npos) << command << read("m.md");
    // The command's second half, on the configuration that the file holds.
    write("again.json", Json::parse(read("r.json"))["config"].dump());
    const std::string filter = command.substr(command.find("--filter"));
    ASSERT_EQ(run("run again.json -o again.results.json --force " + filter, NULLMARK_PLANTED_PROGRAM), 0) << read("err");
    const RunRecord again = results("again.results.json");
    ASSERT_EQ(again.cells.size(), 1u);
    EXPECT_EQ(verdict_json(*again.cells[0].verdict), verdict_json(*results("r.json").cells[0].verdict));
  }
}

TEST_F(Check, OnlyOpenVerdictsAreNoSuccess) {
  write(
      "o.json",
      config(
          R"("rays":"single","samples_per_ray":100,"matrix":{"estimator":["delta"],"medium":["linear"]},"verdict":{"epsilon":0.001})"));
  ASSERT_EQ(run("run o.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --junit j.xml"), 77) << read("out");
  EXPECT_NE(read("j.xml").find("<skipped message=\"INCONCLUSIVE (as planned, by laws): not decidable at 100 samples a ray; a "
                               "PASS at epsilon 0.001 needs"),
            std::string::npos)
      << read("j.xml");
  EXPECT_NE(read("out").find("INCONCLUSIVE (as planned, by laws)"), std::string::npos) << read("out");
}

TEST_F(Check, NothingJudgedIsNoSuccess) {
  write(
      "n.json",
      config(
          R"("rays":"single","samples_per_ray":100,"matrix":{"estimator":["ratio"],"medium":["linear"]},"verdict":{"enabled":false})"));
  ASSERT_EQ(run("run n.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json"), 5) << read("out");
}

TEST_F(Check, AMarchIsJudgedByItsOwnMeanAlone) {
  write("m.json", config(R"("rays":"single","samples_per_ray":4000,
      "matrix":{"estimator":[{"type":"ray_marching","offset":["left","midpoint","uniform"],"steps":[16,32,64,128]}],
                "medium":[{"type":"exponential","optical_depth":0.5}]})"));
  ASSERT_EQ(run("run m.json -o r.json"), 0) << read("err");
  const Json results = Json::parse(read("r.json"));
  for (const Json& cell : results["cells"]) {
    EXPECT_TRUE(cell["verdict"]["unbiased"].is_null()) << cell;
    EXPECT_EQ(cell["verdict"]["own_mean"], "PASS") << cell["verdict"];
  }
  EXPECT_EQ(run("check r.json"), 0) << read("out");
  for (const char* order : {"offset:left/exponential/optical_depth:0.5/transmittance/single: claimed order 1, measured 1.0",
                            "offset:midpoint/exponential/optical_depth:0.5/transmittance/single: claimed order 2, measured 2.0"})
    EXPECT_NE(read("out").find(order), std::string::npos) << read("out");
  Json json = Json::parse(read("r.json"));
  json["cells"][0]["verdict"]["unbiased"] = "PASS";
  write("t.json", json.dump());
  EXPECT_EQ(run("check t.json"), 1) << read("out");
}

TEST_F(Check, ShardsHaveTheVerdictsOfTheWhole) {
  ASSERT_EQ(run("run c.json -o whole.json --threads 1"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o a.json --shard 1/2 --threads 2"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json --shard 2/2"), 0) << read("err");
  ASSERT_EQ(run("merge a.json b.json -o merged.json"), 0) << read("err");
  const Json whole = Json::parse(read("whole.json")), merged = Json::parse(read("merged.json"));
  ASSERT_EQ(merged["cells"].size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(merged["cells"][i]["verdict"], whole["cells"][i]["verdict"]);
  ASSERT_EQ(run("check whole.json"), 0);
  const std::string expected = read("out");
  EXPECT_EQ(run("check merged.json"), 0);
  EXPECT_EQ(read("out"), expected);
}

}  // namespace
}  // namespace nullmark
