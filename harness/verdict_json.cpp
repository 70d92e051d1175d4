#include "harness/verdict_json.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nullmark {
namespace {

constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();

const std::vector<std::string> kOutcomes = {"", "PASS", "FAIL", "INCONCLUSIVE", "VIOLATED"};

Json real(Real x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json outcome_json(Outcome outcome) { return outcome == Outcome::none ? Json(nullptr) : Json(to_string(outcome)); }

Outcome read_outcome(const Place& place) {
  if (place.json().is_null()) return Outcome::none;
  return static_cast<Outcome>(std::find(kOutcomes.begin(), kOutcomes.end(), place.one_of(kOutcomes, "verdict")) -
                              kOutcomes.begin());
}

/// An infinite figure is written as null: evidence that is not there proves nothing, an error that is not finite is the largest.
Real read_real(const Place& object, const char* key, Real instead) {
  return object.has(key) && !object[key].json().is_null() ? object[key].number() : instead;
}

Json test_json(const TestRecord& test) {
  Json json = {{"channel", test.channel},
               {"group", test.group},
               {"samples", test.samples},
               {"epsilon", real(test.epsilon)},
               {"reference_error", real(test.reference_error)},
               {"variance", real(test.variance)},
               {"basis", test.basis}};
  if (test.basis == "deterministic") {
    json["largest_error"] = real(test.largest_error);
    json["rounding"] = real(test.rounding);
  } else {
    json["log_e"] = {{"fail", real(test.log_e_fail)}, {"low", real(test.log_e_low)}, {"high", real(test.log_e_high)}};
    json["planned"] = test.planned;
    if (test.group < 0) json["rates"] = test.rates;
  }
  json["outcome"] = outcome_json(test.outcome);
  return json;
}

TestRecord read_test(const Place& place) {
  place.expect_object();
  TestRecord test;
  test.channel = static_cast<int>(place["channel"].integer(-1, kMaxChannels - 1));
  test.group = static_cast<int>(place["group"].integer(-1, 1 << 20));
  test.samples = place["samples"].unsigned_integer(0, kAny);
  test.epsilon = read_real(place, "epsilon", 0);
  test.reference_error = read_real(place, "reference_error", kInfinity);
  test.variance = read_real(place, "variance", kInfinity);
  test.basis = place["basis"].one_of({"betting", "catoni", "catoni+betting", "deterministic"}, "basis");
  test.largest_error = read_real(place, "largest_error", kInfinity);
  test.rounding = read_real(place, "rounding", 0);
  if (test.basis != "deterministic") {
    const Place log_e = place["log_e"];
    log_e.expect_object();
    test.log_e_fail = read_real(log_e, "fail", -kInfinity);
    test.log_e_low = read_real(log_e, "low", -kInfinity);
    test.log_e_high = read_real(log_e, "high", -kInfinity);
    test.planned = place["planned"].unsigned_integer(0, kAny);
    if (place.has("rates"))
      for (const Place& rate : place["rates"].elements()) test.rates.push_back(rate.number());
  }
  test.outcome = read_outcome(place["outcome"]);
  return test;
}

}  // namespace

const char* to_string(Outcome outcome) { return kOutcomes[static_cast<std::size_t>(outcome)].c_str(); }

Json verdict_json(const VerdictRecord& verdict) {
  Json tests = Json::array();
  for (const TestRecord& test : verdict.tests) tests.push_back(test_json(test));
  return {{"unbiased", outcome_json(verdict.unbiased)},
          {"own_mean", outcome_json(verdict.own_mean)},
          {"lookups", outcome_json(verdict.lookups)},
          {"reason", verdict.reason},
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
          {"tests", std::move(tests)}};
}

VerdictRecord read_verdict(const Place& place) {
  place.expect_object();
  VerdictRecord verdict;
  verdict.unbiased = read_outcome(place["unbiased"]);
  verdict.own_mean = read_outcome(place["own_mean"]);
  verdict.lookups = read_outcome(place["lookups"]);
  verdict.reason = place["reason"].string();
  verdict.against = place["against"].one_of({"reference", "own mean"}, "target");
  verdict.variance_basis = place["variance_basis"].one_of({"analytic", "pilot", "none"}, "basis");
  verdict.planned_undecidable = place["planned_undecidable"].boolean();
  verdict.violated = place["violated"].boolean();
  verdict.nonfinite = place["nonfinite"].unsigned_integer(0, kAny);
  verdict.out_of_range = place["out_of_range"].unsigned_integer(0, kAny);
  verdict.samples_per_ray = place["samples_per_ray"].unsigned_integer(0, kAny);
  verdict.planned = place["planned"].unsigned_integer(0, kAny);
  verdict.affordable = place["affordable"].unsigned_integer(0, kAny);
  verdict.family = place["family"].unsigned_integer(1, kAny);
  verdict.lookups_family = place["lookups_family"].unsigned_integer(1, kAny);
  const auto level = [&](const char* key) {
    const Real value = place[key].number();
    if (!(value > 0 && value < 1)) place[key].expected("a number between 0 and 1");
    return value;
  };
  verdict.alpha = level("alpha");
  verdict.alpha_pass = level("alpha_pass");
  for (const Place& test : place["tests"].elements()) verdict.tests.push_back(read_test(test));
  return verdict;
}

}  // namespace nullmark
