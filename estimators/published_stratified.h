#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Stratified ray marching as the program behind Kozelj's comparison ran it: step i of k = `steps`, from 0, looks up (i - u) h
/// with h = d/k.  Its first lookup lies before the ray, where the scene is empty, so the last stratum is never looked up.  On
/// constant extinction it gives T^(1 - 1/k) instead of T.  Registered to show what that does to the published table.
template <class Value>
struct PublishedStratified {
  static constexpr const char* kName = "stratified_published_offset";
  static constexpr const char* kSummary = "stratified ray marching with the offsets of a published comparison (biased)";
  static constexpr const char* kSource = "Kozelj, Comparison of transmittance and distance estimators: program";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kGreyOnly = true;
  static constexpr bool kIgnoresMajorant = true;

  int steps = 1000;

  void parameters(ParameterVisitor& visit) {
    visit.integer("steps", steps, 2, 10'000'000, "steps per sample, k, of which k - 1 look up");
  }

  Guarantee claim(Quantity) const { return Guarantee::biased; }

  struct RayData : MediumRay<Value> {
    Real step = 0;
  };

  void prepare(RayData& ray) const { ray.step = ray.length() / steps; }

  struct Walk {
    Value sum;
    int next = 1;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const { walk = {ray.value(0), 1}; }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (!(ray.step > 0) || walk.next == steps) return false;
    flight.jump(ray.begin + (walk.next++ - rng.uniform()) * ray.step);
    return true;
  }

  void consume(Walk& walk, const RayData&, const Flight&, const Value& extinction, auto&) const { walk.sum += extinction; }

  Value result(const Walk& walk, const RayData& ray) const { return exponential(Value(-walk.sum * ray.step)); }
};

}  // namespace nullmark
