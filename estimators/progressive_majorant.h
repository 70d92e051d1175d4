#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"

namespace nullmark {

/// Ratio tracking under majorants learned as it goes [Misso, Li, Burley, Teece, Jarosz 2023].  Every cell of the scene's majorant
/// structure keeps a bound B of its own, at first `initial`; of the structure's own bounds nothing is used.  A pass flies at rate
/// B through the extinction min(mu, B); a lookup mu > B ends it with 0, which is what min(mu, B) = B gives, and sets B = mu +
/// `margin`.
///
/// A sample is pass number `passes`: it flies the ones before it from the same stream and learns from them, so that samples stay
/// independent and depend on their address alone.  Its law is that of sample number `passes` of one ray rendered progressively
/// (whose samples share their history, so that their mean's bias is the average over passes 0, 1, ... of what is measured here).
/// Lookups are those of all passes, since all are flown; a renderer, which flies each pass once, pays their differences.
///
/// With bounds B the mean is exp(-int min(mu, B)) >= T, so the bias falls with `passes` as cells find their bound: consistent. On
/// constant extinction mu > B_0 over a length d it is e^{-n B_0 d} (e^{-B_0 d} - T) after n passes, the chance that none of them
/// has met the medium.  Several channels share the walk, B bounds the largest; a pass ends where no channel is left.
template <class Value>
struct ProgressiveMajorant {
  static constexpr const char* kName = "progressive_majorant";
  static constexpr const char* kSummary = "ratio tracking under bounds learned in earlier passes of the same sample";
  static constexpr const char* kSource = "Misso, Li, Burley, Teece, Jarosz 2023, Sec. 4";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;

  int passes = 64;
  Real initial = 0.01, margin = 0.2;

  void parameters(ParameterVisitor& visit) {
    visit.integer("passes", passes, 0, 1'000'000, "learning passes before the one that gives the result");
    visit.number("initial", initial, Range::positive(), "1/length", "initial bound of every cell");
    visit.number("margin", margin, Range::non_negative(), "1/length", "a violated bound is raised to the extinction plus this");
  }

  Guarantee claim(Quantity) const { return Guarantee::consistent; }

  struct Walk {
    Value weight;
    std::vector<Real> bounds;  ///< per cell
    std::size_t cell = 0;
    Real position = 0;
    int pass = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const {
    walk.bounds.assign(ray.majorant.size(), initial);
    walk.pass = 0;
    begin_pass(walk, ray);
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    for (;;) {
      if (!vanished(walk.weight) && fly(walk, ray, rng)) {
        flight.jump(walk.position);
        return true;
      }
      if (walk.pass == passes) return false;
      ++walk.pass;
      begin_pass(walk, ray);
    }
  }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight&, const Value& extinction, auto&) const {
    const Real bound = walk.bounds[walk.cell];
    for (int c = 0; c < ray.channels; ++c) channel(walk.weight, c) *= std::max<Real>(0, bound - channel(extinction, c)) / bound;
    if (const Real most = largest(extinction); most > bound) walk.bounds[walk.cell] = most + margin;
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.weight; }

  /// Of the first pass of one channel, whose bounds are given: the mean is clamped, its relative variance exp(int min(mu, B)^2/B)
  /// - 1; lookups int B e^{-int B [mu > B]}, as those end the walk.
  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    if (passes > 0 || ray.channels > 1) return {};
    Rates level;
    level.start(ray.begin);
    for (std::size_t i = 0; i < ray.majorant.size(); ++i) level.append(ray.majorant.end(i), initial);
    const RayProfile cut = cut_at_levels(profile, ray.majorant, {&level});
    const auto clamped = [&](const RayProfile::Node& at) { return std::min(at.extinction, initial); };
    const Real depth = cut.integrate(c, clamped);
    const Real spread = cut.integrate(c, [&](const auto& at) { return clamped(at) * clamped(at) / initial; });
    const auto ended = cut.running(c, [&](const auto& at) { return at.extinction > initial ? initial : 0; });
    std::size_t j = 0;
    const Real lookups = cut.integrate(c, [&](const auto&) { return initial * std::exp(-ended[j++]); });
    return {.mean = std::exp(-depth), .variance = std::exp(-2 * depth) * std::expm1(spread), .lookups = lookups};
  }

 private:
  static void begin_pass(Walk& walk, const MediumRay<Value>& ray) {
    walk.weight = ray.value(1);
    walk.cell = 0;
    walk.position = ray.begin;
  }

  /// To the next lookup; false where it lies beyond the ray.
  static bool fly(Walk& walk, const MediumRay<Value>& ray, auto& rng) {
    Real depth = rng.exponential();
    for (; walk.cell < walk.bounds.size(); ++walk.cell) {
      const Real bound = walk.bounds[walk.cell], room = bound * (ray.majorant.end(walk.cell) - walk.position);
      if (depth < room) {
        walk.position += depth / bound;
        return true;
      }
      depth -= room;
      walk.position = ray.majorant.end(walk.cell);
    }
    return false;
  }
};

}  // namespace nullmark
