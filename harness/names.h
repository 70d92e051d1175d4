#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// The words of configurations, results and tables.
inline const char* to_string(Claim claim) {
  switch (claim) {
    case Claim::exact:
      return "exact";
    case Claim::unbiased:
      return "unbiased";
    case Claim::consistent:
      return "consistent";
    case Claim::biased:
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

inline const char* to_string(Quantity quantity) {
  return quantity == Quantity::transmittance ? "transmittance" : "optical_depth";
}

}  // namespace nullmark
