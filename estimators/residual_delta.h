#pragma once

#include "estimators/control.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Residual delta tracking: T_c times a delta estimate of T_r [Novák, Selle, Jarosz 2014, Sec. 4].  The control must not exceed
/// the extinction.  Values {0, T_c}, Var = T (T_c - T), lookups int mubr exp(-int_0^x (mu - mu_c)).  Channels share one walk.
template <class Value>
struct ResidualDeltaTracking {
  static constexpr const char* kName = "residual_delta";
  static constexpr const char* kSummary = "residual delta tracking: closed-form control times a delta estimate of the residual";
  static constexpr const char* kSource = "Novak, Selle, Jarosz 2014, Sec. 4";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = true;
  static constexpr bool kLanes = true;

  ControlChoice choice;

  void parameters(ParameterVisitor& visit) {
    visit.choice("control", choice.kind, {"minimum", "given"}, "control extinction: the segment's minimum, or given");
    visit.number("value", choice.value, Range::non_negative(), "1/length",
                 "control extinction (given); at most the medium's minimum");
  }

  void check(const MatterBounds& medium) const {
    if (choice.kind == "given" && choice.value > medium.minimum.minCoeff())
      throw ParameterError("value", "control exceeds the medium's least extinction; residual delta tracking needs mu_c <= mu");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Control<Value> control;
    Rates residual;
  };

  /// The rate is what the majorant leaves above the smallest control of all channels, so that a loose majorant stays loose.
  void prepare(RayData& ray) const {
    prepare_control<Value>(choice, ray, ray.control, ray.residual);
    ray.residual.start(ray.begin, ray.bounds.crossing());
    for (std::size_t i = 0; i < ray.bounds.segments().size(); ++i) {
      const Segment& segment = ray.bounds.segments()[i];
      ray.residual.append(segment.end, std::max<Real>(0, segment.majorant - smallest(ray.control.of_segment[i])));
    }
  }

  struct Walk {
    Value transmittance;  ///< estimate of T_r, 1 until the channel dies
    Truth<Value> done = false;
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk = {ray.value(1), false};
    flight.start(ray.residual);
  }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.done); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> threshold = rng.uniform() * at.rate();
    const Value residual = extinction - ray.control.at(at.position(), at.piece());
    walk.transmittance = select(residual > threshold, ray.value(0), walk.transmittance);
    walk.done = vanished(walk.transmittance);
  }

  Value result(const Walk& walk, const auto& ray) const { return exponential(Value(-ray.control.depth)) * walk.transmittance; }

  Value transmittance_at(const Walk& walk, const RayData& ray, Real distance) const {
    return exponential(Value(-ray.control.depth_to(distance))) * walk.transmittance;
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.done; }

  /// Where the rate is violated every collision is accepted: the walk sees min(mu - mu_c, mubr).
  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const auto rate = [&](const RayProfile::Node& at) { return ray.residual.rate(at.piece); };
    const auto killed = [&](int k, const RayProfile::Node& at) {
      return std::clamp<Real>(at.extinction - channel(ray.control.at(at.t, at.piece), k), 0, rate(at));
    };
    const Real depth = profile.integrate(c, [&](const RayProfile::Node& at) { return killed(c, at); });
    const Real control = channel(ray.control.depth, c);
    Theory theory{.variance = std::exp(-2 * control - depth) * -std::expm1(-depth)};
    state_lookups_until_killed(theory, profile, killed, rate);
    constexpr Real kRounding = 1e-12;
    if (depth + control < profile.optical_depth(c) * (1 - kRounding)) theory.mean = std::exp(-control - depth);
    return theory;
  }
};

}  // namespace nullmark
