#include "harness/io/verdict_json.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/io/spec_json.h"
#include "harness/kernel/kernel.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

/// Numbers that a sample gives at most: a free path's scores in every channel.
constexpr int kMaxOutputs = kMaxChannels * (static_cast<int>(kFreePathBins) + 3);

const std::vector<std::string> kBases = {"betting", "catoni", "catoni+betting", "deterministic", "none", "counted"};

Json outcome_json(Outcome outcome) { return outcome == Outcome::none ? Json(nullptr) : Json(to_string(outcome)); }

Outcome read_outcome(const JsonNode& node) {
  if (node.json().is_null()) return Outcome::none;
  return static_cast<Outcome>(std::find(outcome_names().begin(), outcome_names().end(), node.one_of(outcome_names(), "verdict")) -
                              outcome_names().begin());
}

/// An infinite figure is written as null: evidence that is not there proves nothing, an error that is not finite is the largest.
Real read_real(const JsonNode& object, const char* key, Real instead) {
  return object.has(key) && !object[key].json().is_null() ? object[key].number() : instead;
}

Json test_json(const TestRecord& test) {
  Json json = {{"channel", test.channel},
               {"samples", test.samples},
               {"epsilon", number_or_null(test.epsilon)},
               {"reference_error", number_or_null(test.reference_error)},
               {"variance", number_or_null(test.variance)},
               {"basis", test.basis},
               {"reference", number_or_null(test.reference)},
               {"mean_error", number_or_null(test.mean_error)}};
  if (test.deterministic()) {
    json["largest_error"] = number_or_null(test.largest_error);
    json["rounding"] = number_or_null(test.rounding);
  } else {
    json["log_e"] = {{"fail", number_or_null(test.log_e_fail)},
                     {"low", number_or_null(test.log_e_low)},
                     {"high", number_or_null(test.log_e_high)},
                     {"beyond", number_or_null(test.log_e_beyond)}};
    json["planned"] = test.planned;
    json["rates"] = test.rates;
  }
  json["outcome"] = outcome_json(test.outcome);
  return json;
}

/// The ray groups of a channel, one figure a list: they are many.
Json groups_json(const std::vector<const TestRecord*>& groups) {
  const TestRecord& first = *groups.front();
  Json json = {{"epsilon", number_or_null(first.epsilon)}, {"samples", first.samples}};
  const auto list = [&](const char* key, Real TestRecord::*figure) {
    for (const TestRecord* test : groups) json[key].push_back(number_or_null(test->*figure));
  };
  for (const TestRecord* test : groups) json["basis"].push_back(test->basis);
  list("reference_error", &TestRecord::reference_error);
  list("log_e_fail", &TestRecord::log_e_fail);
  list("log_e_low", &TestRecord::log_e_low);
  list("log_e_high", &TestRecord::log_e_high);
  list("log_e_beyond", &TestRecord::log_e_beyond);
  list("reference", &TestRecord::reference);
  list("mean_error", &TestRecord::mean_error);
  if (std::any_of(groups.begin(), groups.end(), [](const TestRecord* test) { return test->deterministic(); })) {
    list("largest_error", &TestRecord::largest_error);
    list("rounding", &TestRecord::rounding);
  }
  return json;
}

TestRecord read_test(const JsonNode& node) {
  node.expect_object();
  TestRecord test;
  test.channel = static_cast<int>(node["channel"].integer(-1, kMaxOutputs - 1));
  test.samples = node["samples"].unsigned_integer(0);
  test.epsilon = read_real(node, "epsilon", 0);
  test.reference_error = read_real(node, "reference_error", kInfinity);
  test.variance = read_real(node, "variance", kInfinity);
  test.basis = node["basis"].one_of(kBases, "basis");
  test.reference = read_real(node, "reference", 0);
  test.mean_error = read_real(node, "mean_error", 0);
  test.largest_error = read_real(node, "largest_error", kInfinity);
  test.rounding = read_real(node, "rounding", 0);
  if (!test.deterministic()) {
    const JsonNode log_e = node["log_e"];
    log_e.expect_object();
    test.log_e_fail = read_real(log_e, "fail", -kInfinity);
    test.log_e_low = read_real(log_e, "low", -kInfinity);
    test.log_e_high = read_real(log_e, "high", -kInfinity);
    test.log_e_beyond = read_real(log_e, "beyond", -kInfinity);
    test.planned = node["planned"].unsigned_integer(0);
    if (node.has("rates"))
      for (const JsonNode& rate : node["rates"].elements())
        if (!rate.json().is_null()) test.rates.push_back(rate.number());
  }
  test.outcome = read_outcome(node["outcome"]);
  return test;
}

void read_groups(const JsonNode& node, int channel, std::vector<TestRecord>& tests) {
  node.expect_object();
  const std::vector<JsonNode> basis = node["basis"].elements();
  std::vector<TestRecord> groups(basis.size());
  const auto read = [&](const char* key, Real TestRecord::*figure, Real instead) {
    if (!node.has(key)) return;
    const std::vector<JsonNode> figures = node[key].elements();
    if (figures.size() != groups.size()) node[key].fail("found another number of entries than in \"basis\"");
    for (std::size_t i = 0; i < groups.size(); ++i)
      groups[i].*figure = figures[i].json().is_null() ? instead : figures[i].number();
  };
  for (std::size_t i = 0; i < groups.size(); ++i) {
    groups[i].channel = channel;
    groups[i].group = static_cast<int>(i);
    groups[i].basis = basis[i].one_of(kBases, "basis");
    groups[i].epsilon = read_real(node, "epsilon", 0);
    groups[i].samples = node["samples"].unsigned_integer(0);
    groups[i].largest_error = kInfinity;
    groups[i].log_e_beyond = -kInfinity;
  }
  read("reference_error", &TestRecord::reference_error, kInfinity);
  read("log_e_fail", &TestRecord::log_e_fail, -kInfinity);
  read("log_e_low", &TestRecord::log_e_low, -kInfinity);
  read("log_e_high", &TestRecord::log_e_high, -kInfinity);
  read("log_e_beyond", &TestRecord::log_e_beyond, -kInfinity);
  read("reference", &TestRecord::reference, 0);
  read("mean_error", &TestRecord::mean_error, 0);
  read("largest_error", &TestRecord::largest_error, kInfinity);
  read("rounding", &TestRecord::rounding, 0);
  tests.insert(tests.end(), groups.begin(), groups.end());
}

}  // namespace

Json verdict_json(const VerdictRecord& verdict) {
  Json tests = Json::array();
  for (std::size_t i = 0; i < verdict.tests.size(); ++i) {
    tests.push_back(test_json(verdict.tests[i]));
    std::vector<const TestRecord*> groups;
    while (i + 1 < verdict.tests.size() && verdict.tests[i + 1].group >= 0) groups.push_back(&verdict.tests[++i]);
    if (!groups.empty()) tests.back()["groups"] = groups_json(groups);
  }
  Json laws = Json::array();
  for (const LawRecord& law : verdict.laws)
    laws.push_back({{"name", law.name},
                    {"log_e", number_or_null(law.log_e)},
                    {"samples", law.samples},
                    {"outcome", outcome_json(law.outcome)}});
  Json proven = Json::array();
  if (verdict.within) proven.push_back("within");
  if (verdict.beyond) proven.push_back("beyond");
  if (verdict.biased) proven.push_back("biased");
  return {{"unbiased", outcome_json(verdict.unbiased)},
          {"own_mean", outcome_json(verdict.own_mean)},
          {"lookups", outcome_json(verdict.lookups)},
          {"reason", verdict.reason},
          {"proves", verdict.proves},
          {"proven", std::move(proven)},
          {"tolerate", tolerances()[static_cast<std::size_t>(verdict.tolerate)]},
          {"bound_unproven", verdict.bound_unproven},
          {"counted_walks", verdict.counted_walks},
          {"untested", verdict.untested},
          {"against", verdict.against},
          {"variance_basis", verdict.variance_basis},
          {"planned_undecidable", verdict.planned_undecidable},
          {"violated", verdict.violated},
          {"nonfinite", verdict.nonfinite},
          {"out_of_range", verdict.out_of_range},
          {"samples_per_ray", verdict.samples_per_ray},
          {"planned", verdict.planned},
          {"affordable", verdict.affordable},
          {"family", verdict.family},
          {"lookups_family", verdict.lookups_family},
          {"alpha", verdict.alpha},
          {"alpha_pass", verdict.alpha_pass},
          {"tests", std::move(tests)},
          {"laws_family", verdict.laws_family},
          {"laws", std::move(laws)},
          {"lawful", outcome_json(verdict.lawful)}};
}

VerdictRecord read_verdict(const JsonNode& node) {
  node.expect_object();
  VerdictRecord verdict;
  verdict.unbiased = read_outcome(node["unbiased"]);
  verdict.own_mean = read_outcome(node["own_mean"]);
  verdict.lookups = read_outcome(node["lookups"]);
  verdict.reason = node["reason"].string();
  if (node.has("proves")) verdict.proves = node["proves"].string();
  if (node.has("proven"))
    for (const JsonNode& what : node["proven"].elements()) {
      const std::string word = what.one_of({"within", "beyond", "biased"}, "finding");
      (word == "within" ? verdict.within : word == "beyond" ? verdict.beyond : verdict.biased) = true;
    }
  if (node.has("tolerate") && node["tolerate"].one_of(tolerances(), "bias to tolerate") == tolerances()[1])
    verdict.tolerate = Tolerate::epsilon;
  if (node.has("bound_unproven")) verdict.bound_unproven = node["bound_unproven"].boolean();
  if (node.has("counted_walks")) verdict.counted_walks = node["counted_walks"].unsigned_integer(0);
  if (node.has("untested"))
    for (const JsonNode& law : node["untested"].elements()) verdict.untested.push_back(law.string());
  verdict.against = node["against"].one_of({"reference", "own mean"}, "target");
  verdict.variance_basis = node["variance_basis"].one_of({"analytic", "pilot", "none"}, "basis");
  verdict.planned_undecidable = node["planned_undecidable"].boolean();
  verdict.violated = node["violated"].boolean();
  verdict.nonfinite = node["nonfinite"].unsigned_integer(0);
  verdict.out_of_range = node["out_of_range"].unsigned_integer(0);
  verdict.samples_per_ray = node["samples_per_ray"].unsigned_integer(0);
  verdict.planned = node["planned"].unsigned_integer(0);
  // Files without a tolerance are of before PASS took the planned samples.
  if (!node.has("tolerate")) verdict.planned = std::min(verdict.planned, verdict.samples_per_ray);
  verdict.affordable = node["affordable"].unsigned_integer(0);
  verdict.family = node["family"].unsigned_integer(1);
  verdict.lookups_family = node["lookups_family"].unsigned_integer(1);
  const auto level = [&](const char* key) {
    const Real value = node[key].number();
    if (!(value > 0 && value < 1)) node[key].expected("a number between 0 and 1");
    return value;
  };
  verdict.alpha = level("alpha");
  verdict.alpha_pass = level("alpha_pass");
  for (const JsonNode& test : node["tests"].elements()) {
    verdict.tests.push_back(read_test(test));
    if (test.has("groups")) read_groups(test["groups"], verdict.tests.back().channel, verdict.tests);
  }
  verdict.laws_family = node["laws_family"].unsigned_integer(1);
  for (const JsonNode& law : node["laws"].elements())
    verdict.laws.push_back({law["name"].string(), read_real(law, "log_e", kInfinity), law["samples"].unsigned_integer(0),
                            read_outcome(law["outcome"])});
  verdict.lawful = read_outcome(node["lawful"]);
  return verdict;
}

}  // namespace nullmark
