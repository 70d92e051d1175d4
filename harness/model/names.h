#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimators/walk/quantity.h"
#include "harness/model/record.h"

namespace nullmark {

/// The words of configurations, results and tables.
inline const char* to_string(Guarantee claim) {
  switch (claim) {
    case Guarantee::exact:
      return "exact";
    case Guarantee::unbiased:
      return "unbiased";
    case Guarantee::consistent:
      return "consistent";
    case Guarantee::biased:
      break;
  }
  return "biased";
}

inline const char* to_string(SampleRange range) {
  switch (range) {
    case SampleRange::binary:
      return "binary";
    case SampleRange::unit:
      return "unit";
    case SampleRange::non_negative:
      return "non_negative";
    case SampleRange::any_sign:
      break;
  }
  return "signed";
}

inline const std::vector<std::string>& quantity_names() {
  static const std::vector<std::string> kNames = {"transmittance", "optical_depth", "transmittance_profile", "free_path",
                                                  "radiance"};
  return kNames;
}

inline const std::string& to_string(Quantity quantity) { return quantity_names()[static_cast<std::size_t>(quantity)]; }

inline const std::vector<std::string>& precision_names() {
  static const std::vector<std::string> kNames = {"double", "float"};
  return kNames;
}

inline const std::string& to_string(Precision precision) { return precision_names()[static_cast<std::size_t>(precision)]; }

/// The precision of a name that is one of them.
inline Precision precision_named(const std::string& name) {
  return name == precision_names()[0] ? Precision::float64 : Precision::float32;
}

/// The quantity of a name; nothing where there is none.
inline std::optional<Quantity> quantity_named(const std::string& name) {
  for (std::size_t i = 0; i < quantity_names().size(); ++i)
    if (quantity_names()[i] == name) return static_cast<Quantity>(i);
  return std::nullopt;
}

inline const std::vector<std::string>& status_names() {
  static const std::vector<std::string> kNames = {"ok", "skipped", "not_run", "error"};
  return kNames;
}

inline const char* to_string(Status status) { return status_names()[static_cast<std::size_t>(status)].c_str(); }

inline const std::vector<std::string>& outcome_names() {
  static const std::vector<std::string> kNames = {"", "PASS", "FAIL", "INCONCLUSIVE", "VIOLATED"};
  return kNames;
}

/// In the order of TestBasis.
inline const std::vector<std::string>& test_bases() {
  static const std::vector<std::string> kNames = {"betting", "catoni", "catoni+betting", "deterministic", "none", "counted"};
  return kNames;
}

/// In the order of LawPolicy.
inline const std::vector<std::string>& law_policies() {
  static const std::vector<std::string> kNames = {"undecided", "always", "never"};
  return kNames;
}

/// In the order of Tolerate.
inline const std::vector<std::string>& tolerances() {
  static const std::vector<std::string> kNames = {"nothing", "epsilon"};
  return kNames;
}

inline const char* to_string(Outcome outcome) { return outcome_names()[static_cast<std::size_t>(outcome)].c_str(); }

}  // namespace nullmark
