#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// T = exp(-tau) from the medium's closed form; no lookup, no random number.
template <class Value>
struct ClosedForm {
  static constexpr const char* kName = "closed_form";
  static constexpr const char* kSummary = "Beer-Lambert law on a closed-form optical depth";
  static constexpr const char* kSource = "Beer-Lambert";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kNeedsOpticalDepth = true;

  Claim claim(Quantity) const { return Claim::exact; }

  struct Walk {};

  void init(Walk&, const Passage<Value>&, Flight&, auto&) const {}
  bool propose(Walk&, const Passage<Value>&, Flight&, auto&) const { return false; }
  void consume(Walk&, const Passage<Value>&, const Flight&, const Value&, auto&) const {}

  Value result(const Walk&, const Passage<Value>& ray) const { return exponential(Value(-*ray.exact_depth)); }
  Value optical_depth(const Walk&, const Passage<Value>& ray) const { return *ray.exact_depth; }

  Theory theory(const Passage<Value>&, const RayProfile&, int, Quantity) const {
    return {.variance = 0, .lookups = 0, .lookups_variance = 0};
  }
};

}  // namespace nullmark
