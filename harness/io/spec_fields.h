#pragma once

#include <vector>

#include "harness/io/fields.h"
#include "harness/model/plan.h"

/// The parts of a configuration that are structs of keys.
namespace nullmark {

/// In the order of VerdictSpec::all_samples.
inline const std::vector<std::string>& sample_policies() {
  static const std::vector<std::string> kNames = {"planned", "all"};
  return kNames;
}

/// One number, or an ascending list.
struct BatchesField {
  std::vector<std::uint64_t>& value;

  Json json() const { return value.size() == 1 ? Json(value[0]) : Json(value); }
  void read(const JsonNode& node) const {
    value.clear();
    for (const JsonNode& element : node.elements_or_self()) {
      value.push_back(element.unsigned_integer(1, 1u << 20));
      if (value.size() > 1 && value.back() <= value[value.size() - 2]) element.expected("more than the number before it");
    }
    if (value.empty()) node.expected("at least one number");
  }
  Json schema() const { return one_or_list_schema(whole_schema(1)); }
};

/// One number, or a list of one per output.
struct OneOrEachField {
  std::vector<Real>& value;

  Json json() const { return value; }
  void read(const JsonNode& node) const {
    for (const JsonNode& element : node.elements_or_self()) value.push_back(element.number());
  }
  Json schema() const { return one_or_list_schema({{"type", "number"}}); }
};

/// A relative bound on an error.
struct BoundField {
  Real& value;

  Json json() const { return value; }
  void read(const JsonNode& node) const {
    value = node.number();
    if (!(value >= 0)) node.expected("a relative bound >= 0");
  }
  Json schema() const { return {{"type", "number"}, {"minimum", 0}}; }
};

template <class Visit>
void visit_fields(Visit& visit, Measurement& measurement) {
  visit.lenient("clamp", measurement.clamp, "every sample to [0,1]");
  visit.lenient("quantise_bits", WithinField{measurement.quantise_bits, 0, 31},
                "every sample to the nearest multiple of 1/(2^n - 1); 0: not at all");
}

template <class Visit>
void visit_fields(Visit& visit, VerdictSpec& spec) {
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  visit.lenient("enabled", spec.enabled);
  visit.lenient(
      "max_samples_per_ray", WithinField{spec.max_samples_per_ray, 0, kMost},
      "drawn while the verdict is open; 0: samples_per_ray, and up to four times as many if the plan says that they suffice");
  visit.lenient("laws", spec.laws, "when the laws of walks are tested; undecided: only if the mean cannot be decided");
  visit.sparse("tolerate", spec.tolerate, "nothing: any proven bias is a FAIL; epsilon: only a bias proven beyond epsilon is");
  visit.sparse("samples", FlagWordField{spec.all_samples, sample_policies(), "policy"},
               "planned: an undecided cell draws no more if the plan says that its allowance does not suffice; all: it draws its "
               "whole allowance");
  visit.sparse("epsilon", LevelField{spec.epsilon}, "a PASS proves |bias| below this; relative to the mean reference");
  visit.sparse("max_lookups_per_ray", PositiveField{spec.max_lookups_per_ray},
               "expected lookups that all samples of a ray may cost");
}

template <class Visit>
void visit_fields(Visit& visit, GivenReference& reference) {
  visit.required("value", OneOrEachField{reference.value});
  visit.required("error", BoundField{reference.error});
  visit.required("source", reference.source);
}

template <class Visit>
void visit_fields(Visit& visit, TimingPlan& timing) {
  visit.lenient("enabled", timing.enabled);
  visit.lenient("repetitions", WithinField{timing.repetitions, 1, 10'000});
  visit.lenient("seconds", PositiveField{timing.seconds}, "minimum time of one repetition");
  visit.lenient("samples_per_traversal", BatchesField{timing.samples_per_traversal},
                "samples that share one walk through the majorant structure; of an ascending list the last is what a cell's time "
                "says");
}

template <class Visit>
void visit_fields(Visit& visit, ErrorRates& rates) {
  visit.lenient("alpha", LevelField{rates.alpha}, "chance of even one false FAIL in the whole configuration");
  visit.lenient("alpha_pass", LevelField{rates.alpha_pass}, "chance of a false PASS of one test");
}

}  // namespace nullmark
