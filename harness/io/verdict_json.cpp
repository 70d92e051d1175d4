#include "harness/io/verdict_json.h"

#include <algorithm>
#include <array>

#include "harness/io/fields.h"
#include "harness/kernel/kernel.h"

namespace nullmark {
namespace {

/// Numbers that a sample gives at most: a free path's scores in every channel.
constexpr int kMaxOutputs = kMaxChannels * (static_cast<int>(kFreePathBins) + 3);

const std::vector<std::string> kTargets = {"reference", "own mean", "difference"};
const std::vector<std::string> kVarianceBases = {"analytic", "pilot", "none"};

// An infinite figure is written as null: evidence that is not there proves nothing, an error that is not finite is the largest.
NullMeansField evidence(Real& value) { return {value, -kInfinity}; }
NullMeansField error(Real& value) { return {value, kInfinity}; }
NullMeansField figure(Real& value) { return {value, 0}; }

/// Those of "within", "beyond" and "biased" that are proven.
struct ProvenField {
  VerdictRecord& verdict;

  std::array<std::pair<const char*, bool*>, 3> flags() const {
    return {{{"within", &verdict.within}, {"beyond", &verdict.beyond}, {"biased", &verdict.biased}}};
  }
  Json json() const {
    Json list = Json::array();
    for (const auto& [word, flag] : flags())
      if (*flag) list.push_back(word);
    return list;
  }
  void read(const JsonNode& node) const {
    for (const JsonNode& element : node.elements()) {
      const std::string found = element.one_of({"within", "beyond", "biased"}, "finding");
      for (const auto& [word, flag] : flags()) *flag |= found == word;
    }
  }
  Json schema() const { return list_schema({{"enum", {"within", "beyond", "biased"}}}); }
};

}  // namespace

template <class Visit>
void visit_fields(Visit& visit, TestRecord& test) {
  visit.required("channel", WithinField{test.channel, -1, kMaxOutputs - 1}, "-1: lookups");
  visit.required("samples", test.samples);
  visit.required("epsilon", figure(test.epsilon), "absolute");
  visit.lenient("reference_error", error(test.reference_error), "absolute");
  visit.lenient("variance", error(test.variance), "that the bets were planned with");
  visit.required("basis", test.basis);
  visit.lenient("reference", figure(test.reference), "expected mean, averaged over the rays of the test");
  visit.lenient("mean_error", figure(test.mean_error), "of the samples against it");
  if (Visit::kDescribes || test.deterministic()) {
    visit.lenient("largest_error", error(test.largest_error), "of single samples, where they are deterministic");
    visit.lenient("rounding", figure(test.rounding));
    visit.sparse("log_e_fail", test.log_e_fail, "against \"mean error 0\", where a sample is off by more than rounding");
  }
  if (!test.deterministic()) {
    visit.part("log_e", [&](auto& inner) {
      inner.lenient("fail", evidence(test.log_e_fail), "against \"mean error 0\"");
      inner.lenient("low", evidence(test.log_e_low), "against \"at most -epsilon\"");
      inner.lenient("high", evidence(test.log_e_high), "against \"at least epsilon\"");
      inner.lenient("beyond", evidence(test.log_e_beyond), "against \"within epsilon\"");
    });
    visit.required("planned", test.planned, "samples per ray");
    visit.lenient("rates", test.rates, "of the bets against \"mean error 0\"");
  }
  visit.required("outcome", test.outcome);
}

namespace {

/// A figure of ray groups, and what null stands for.
struct GroupColumn {
  const char* key;
  Real TestRecord::*figure;
  Real instead;
  bool deterministic = false;
};
constexpr GroupColumn kGroupColumns[] = {{"reference_error", &TestRecord::reference_error, kInfinity},
                                         {"log_e_fail", &TestRecord::log_e_fail, -kInfinity},
                                         {"log_e_low", &TestRecord::log_e_low, -kInfinity},
                                         {"log_e_high", &TestRecord::log_e_high, -kInfinity},
                                         {"log_e_beyond", &TestRecord::log_e_beyond, -kInfinity},
                                         {"reference", &TestRecord::reference, 0},
                                         {"mean_error", &TestRecord::mean_error, 0},
                                         {"largest_error", &TestRecord::largest_error, kInfinity, true},
                                         {"rounding", &TestRecord::rounding, 0, true}};

/// The ray groups of a channel, one figure a list: they are many.
Json groups_json(const std::vector<const TestRecord*>& groups) {
  const TestRecord& first = *groups.front();
  const bool deterministic =
      std::any_of(groups.begin(), groups.end(), [](const TestRecord* test) { return test->deterministic(); });
  Json json = {{"epsilon", number_or_null(first.epsilon)}, {"samples", first.samples}};
  for (const TestRecord* test : groups) json["basis"].push_back(test_bases()[static_cast<std::size_t>(test->basis)]);
  for (const GroupColumn& column : kGroupColumns)
    if (deterministic || !column.deterministic)
      for (const TestRecord* test : groups) json[column.key].push_back(number_or_null(test->*column.figure));
  return json;
}

void read_groups(const JsonNode& node, int channel, std::vector<TestRecord>& tests) {
  node.expect_object();
  const std::vector<JsonNode> basis = node["basis"].elements();
  std::vector<TestRecord> groups(basis.size());
  Real epsilon = 0;
  NullMeansField{epsilon, 0}.read(node["epsilon"]);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    groups[i].channel = channel;
    groups[i].group = static_cast<int>(i);
    groups[i].epsilon = epsilon;
    groups[i].samples = node["samples"].unsigned_integer(0);
    PlainField(groups[i].basis).read(basis[i]);
  }
  for (const auto& [key, figure, instead, deterministic] : kGroupColumns) {
    for (TestRecord& group : groups) group.*figure = instead;
    if (!node.has(key)) continue;
    const std::vector<JsonNode> figures = node[key].elements();
    if (figures.size() != groups.size()) node[key].fail("found another number of entries than in \"basis\"");
    for (std::size_t i = 0; i < groups.size(); ++i) NullMeansField{groups[i].*figure, instead}.read(figures[i]);
  }
  tests.insert(tests.end(), groups.begin(), groups.end());
}

/// What a file leaves out proves nothing.
TestRecord unproven_test() {
  TestRecord test;
  test.reference_error = test.variance = test.largest_error = kInfinity;
  test.log_e_fail = test.log_e_low = test.log_e_high = test.log_e_beyond = -kInfinity;
  return test;
}

/// Tests, each with those of its ray groups.
struct TestsField {
  std::vector<TestRecord>& tests;

  Json json() const {
    Json list = Json::array();
    for (std::size_t i = 0; i < tests.size(); ++i) {
      list.push_back(fields_json(tests[i]));
      std::vector<const TestRecord*> groups;
      while (i + 1 < tests.size() && tests[i + 1].group >= 0) groups.push_back(&tests[++i]);
      if (!groups.empty()) list.back()["groups"] = groups_json(groups);
    }
    return list;
  }
  void read(const JsonNode& node) const {
    for (const JsonNode& element : node.elements()) {
      TestRecord test = unproven_test();
      read_fields(element, test);
      if (test.deterministic()) {
        if (!element.has("log_e_fail")) test.log_e_fail = test.right() ? 0 : kCertain;
        test.log_e_low = test.log_e_high = test.log_e_beyond = 0;
      }
      const int channel = test.channel;
      tests.push_back(std::move(test));
      if (element.has("groups")) read_groups(element["groups"], channel, tests);
    }
  }
  Json schema() const {
    Json json = fields_schema<TestRecord>(false);
    // Deterministic tests bet nothing.
    Json& required = json["required"];
    required.erase(
        std::remove_if(required.begin(), required.end(), [](const Json& key) { return key == "log_e" || key == "planned"; }),
        required.end());
    json["properties"]["groups"] = {{"type", "object"}, {"description", "of rays, one figure a list"}};
    return list_schema(std::move(json));
  }
};

}  // namespace

template <class Visit>
void visit_fields(Visit& visit, VerdictRecord& verdict) {
  visit.required("unbiased", verdict.unbiased, "of the mean, for estimators that claim to be unbiased");
  visit.required("own_mean", verdict.own_mean, "of the mean that the estimator predicts of itself");
  visit.required("lookups", verdict.lookups);
  visit.required("reason", verdict.reason, "of an INCONCLUSIVE, or what fails");
  visit.lenient("proves", verdict.proves, "what a PASS proves");
  visit.lenient("proven", ProvenField{verdict}, "of the mean's error");
  visit.lenient("tolerate", verdict.tolerate);
  visit.lenient("bound_unproven", verdict.bound_unproven, "the majorant is not known to bound, and nothing was seen above it");
  visit.lenient("counted_walks", verdict.counted_walks, "whose lookups were found to be their collisions, one by one");
  visit.lenient("untested", verdict.untested, "what the claims rest on and no law tests, with the reason");
  visit.required("against", WordField{verdict.against, kTargets, "target"});
  visit.required("variance_basis", WordField{verdict.variance_basis, kVarianceBases, "basis"});
  visit.required("planned_undecidable", verdict.planned_undecidable, "no affordable number of samples decides");
  visit.required("violated", verdict.violated, "a true majorant is needed, and the extinction was seen above it");
  visit.required("nonfinite", verdict.nonfinite, "samples, among those beyond the planned ones");
  visit.required("out_of_range", verdict.out_of_range, "samples outside the range that the estimator declares");
  visit.required("samples_per_ray", verdict.samples_per_ray, "used in the end");
  visit.required("planned", verdict.planned, "samples per ray");
  visit.required("affordable", verdict.affordable, "samples per ray");
  visit.required("family", AtLeastField{verdict.family, 1});
  visit.required("lookups_family", AtLeastField{verdict.lookups_family, 1});
  visit.required("alpha", LevelField{verdict.alpha});
  visit.required("alpha_pass", LevelField{verdict.alpha_pass});
  visit.required("tests", TestsField{verdict.tests});
  visit.required("laws_family", AtLeastField{verdict.laws_family, 1});
  visit.list("laws", verdict.laws, [](auto& inner, auto& law) {
    inner.required("name", law.name);
    inner.required("log_e", error(law.log_e), "log of an e-value, or -log of a probability, against the law");
    inner.required("samples", law.samples, "observations");
    inner.required("outcome", law.outcome);
  });
  visit.required("lawful", verdict.lawful);
}

Json verdict_json(const VerdictRecord& verdict) { return fields_json(verdict); }

VerdictRecord read_verdict(const JsonNode& node) {
  VerdictRecord verdict;
  read_fields(node, verdict);
  // Files without a tolerance are of before PASS took the planned samples.
  if (!node.has("tolerate")) verdict.planned = std::min(verdict.planned, verdict.samples_per_ray);
  return verdict;
}

Json verdict_schema() {
  Json json =
      described(fields_schema<VerdictRecord>(false), "evidence for and against the claims; see harness/verdict/verdict.md");
  json["type"] = {"object", "null"};
  return json;
}

}  // namespace nullmark
