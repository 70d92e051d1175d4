#pragma once

#include "estimators/control.h"
#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Analog decomposition tracking [Kutz et al. 2017, Sec. 4.1]: the free path is the shorter of the control's, in closed form,
/// and the residual's, delta tracked at rate mub - mu_c; the residual's path ACCUMULATES over its null collisions.  The control
/// is constant in each segment.  Needs mu_c <= mu <= mub and mub > mu_c.  1 where the walk escapes: Var = T (1 - T), lookups int
/// (mub - mu_c) T(0,x) dx, which is (1 - mu_c/mub) times delta tracking's.
///
/// With `control_albedo` a_c the control absorbs by (1 - a_c) mu_c <= mu_a and scatters by a_c mu_c <= mu_s, and the residual's
/// collision is the one or the other by what is left of mu_a and mu_s.  Without it both are left to the albedo, which must be
/// constant then.  Grey media.
template <class Value>
struct AnalogDecompositionTracking {
  static constexpr const char* kName = "analog_decomposition";
  static constexpr const char* kSummary = "decomposition tracking: the shorter of a closed-form and a delta-tracked free path";
  static constexpr const char* kSource = "Kutz, Habel, Li, Novak 2017, Sec. 4.1";
  static constexpr SampleRange kRange = SampleRange::binary;
  static constexpr bool kNeedsBound = true;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kDrawsExponentials = true;
  static constexpr bool kGreyOnly = true;

  std::string control = "minimum";
  Real factor = 1, value = 0;
  std::vector<Real> control_albedo;

  void parameters(ParameterVisitor& visit) {
    visit.choice("control", control, {"minimum", "given"}, "control extinction: factor times the segment's minimum, or given");
    visit.number("factor", factor, Range::between(0, 1), "", "share of the segment's minimum (minimum)");
    visit.number("value", value, Range::non_negative(), "1/length", "control extinction (given); at most the medium's minimum");
    visit.numbers("control_albedo", control_albedo, 0, 1, Range::between(0, 1), "",
                  "share of the control that scatters (given); neither part may exceed the medium's");
  }

  void check(const MatterBounds& medium) const {
    if (control == "given" && value > medium.minimum[0])
      throw ParameterError("value", "control exceeds the medium's least extinction; " + std::string(kName) +
                                        " needs mu_c <= mu; \"weighted_decomposition\" takes any control");
    expect_control_albedo(medium, control_albedo);
    if (control_albedo.empty()) return;
    const Real scatter = control_albedo[0] * value, absorb = value - scatter;
    if (control != "given" || scatter > medium.least_scattering[0] || absorb > medium.least_absorption[0])
      throw ParameterError("control_albedo", "its control absorbs by " + std::to_string(absorb) + " and scatters by " +
                                                 std::to_string(scatter) + "; the medium is known to absorb by at least " +
                                                 std::to_string(medium.least_absorption[0]) + " and to scatter by at least " +
                                                 std::to_string(medium.least_scattering[0]) +
                                                 "; expected control \"given\" with no more of either");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Rates control, residual;
  };

  void prepare(RayData& ray) const {
    ray.control.start(ray.begin, ray.bounds.crossing());
    ray.residual.start(ray.begin, ray.bounds.crossing());
    for (const Segment& segment : ray.bounds.segments()) {
      const Real mu_c = control == "given" ? value : factor * segment.extinction.minimum[0];
      ray.control.append(segment.end, mu_c);
      ray.residual.append(segment.end, std::max<Real>(0, segment.majorant - mu_c));
    }
  }

  struct Walk {
    Real control_path = 0;  ///< distance of the control's collision, infinite where it has none on the ray
    bool done = false, looked_up = false;
    EventKind kind = EventKind::collision;  ///< of a walk that is done
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    flight.start(ray.control);
    walk = {flight.next(rng) ? flight.position() : kInfinity, false, false, EventKind::collision};
    flight.start(ray.residual);
  }

  bool propose(Walk& walk, const RayData&, Flight& flight, auto& rng) const {
    if (walk.done) return false;
    const bool inside = flight.next(rng);
    if (flight.position() <= walk.control_path) return inside;
    walk.done = true;
    if (!control_albedo.empty()) walk.kind = rng.uniform() < control_albedo[0] ? EventKind::scatter : EventKind::absorb;
    return false;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real mu = channel(extinction, 0), chosen = rng.uniform() * at.rate();
    walk.done = walk.looked_up = chosen < mu - ray.control.rate(at.piece());
    if (control_albedo.empty()) return;
    const Real scatter = channel(ray.albedo_at(at.position()), 0) * mu - control_albedo[0] * ray.control.rate(at.piece());
    walk.kind = chosen < scatter ? EventKind::scatter : EventKind::absorb;
  }

  Value result(const Walk& walk, const RayData& ray) const { return ray.value(walk.done ? 0 : 1); }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    return {walk.done ? walk.kind : EventKind::escape, std::min(walk.control_path, at.position()), ray.value(1)};
  }

  int real_collisions(const Walk& walk, const RayData&) const { return walk.looked_up; }

  /// Where the rate is violated every residual collision is accepted: the walk sees mu_c + min(mu - mu_c, mubr).
  Theory theory(const RayData& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    std::vector<Real> rate, through, alive;
    for (const RayProfile::Node& at : profile.nodes(c)) {
      rate.push_back(ray.residual.rate(at.piece));
      through.push_back(std::max<Real>(0, rate.back() - (at.extinction - ray.control.rate(at.piece))));
      alive.push_back(ray.control.rate(at.piece) + rate.back() - through.back());
    }
    std::size_t j = 0;
    const Real depth = profile.integrate(c, [&](const RayProfile::Node&) { return alive[j++]; });
    Theory theory{.variance = std::exp(-depth) * -std::expm1(-depth)};
    constexpr Real kRounding = 1e-12;
    if (depth < profile.optical_depth(c) * (1 - kRounding)) theory.mean = std::exp(-depth);
    alive = profile.running(alive);
    for (Real& x : alive) x = std::exp(-x);
    state_lookups(theory, profile, rate, through, alive);
    return theory;
  }
};

}  // namespace nullmark
