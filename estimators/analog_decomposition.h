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
  static constexpr bool kLanes = true;

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
    Distance<Value> control_path;  ///< distance of the control's collision, infinite where it has none on the ray
    Truth<Value> done = false, looked_up = false;
    Truth<Value> scatters = false;  ///< of a walk that is done, with a control_albedo
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    flight.start(ray.control);
    const auto collides = flight.next(rng);
    walk = {select(collides, flight.position(), Distance<Value>(kInfinity)), false, false, false};
    flight.start(ray.residual);
  }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const {
    const auto inside = flight.next(rng, !walk.done), overtaken = (walk.control_path < flight.position()) & !walk.done;
    if (!none(overtaken)) {
      if (!control_albedo.empty())
        walk.scatters = walk.scatters | (overtaken & (rng.uniform_where(overtaken) < control_albedo[0]));
      walk.done = overtaken | walk.done;
    }
    return inside & !overtaken;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> mu = channel(extinction, 0), mu_c = rate_of(ray.control, at.piece()),
                          chosen = rng.uniform() * at.rate();
    const auto real = chosen < mu - mu_c;
    walk.done = walk.looked_up = real;
    if (!control_albedo.empty())
      walk.scatters = real & (chosen < grey_albedo(ray, at.position()) * mu - control_albedo[0] * mu_c);
  }

  Value result(const Walk& walk, const auto& ray) const {
    return ray.value(1) * select(walk.done, Distance<Value>(0), Distance<Value>(1));
  }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    return {decomposed_end(walk, control_albedo), std::min(walk.control_path, at.position()), ray.value(1)};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.looked_up; }

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
