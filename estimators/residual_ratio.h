#pragma once

#include "estimators/control.h"

namespace nullmark {

/// Residual ratio tracking [Novák, Selle, Jarosz 2014, Alg. 2]: T = T_c T_r, the control's transmittance in closed form times a
/// ratio estimate of the residual's at rate mubr.  Unbiased for any mubr > 0.  Multiplicands lie in [0,2] with mubr >= max |mu -
/// mu_c|, so samples are non-negative but unbounded.  Var = T^2 (exp(int (mu - mu_c)^2/mubr) - 1), lookups int mubr.  `component`
/// gives T_c or T_r alone.
///
/// Where T_c is as small as e^-1000, T_r is as large as e^1000: such walks carry sgn(W) |W|^(1/2^roots) and the product is taken
/// before it is raised.  By Markov's inequality a weight outgrows e^growth_depth 2^k with probability 2^-k, so `roots` covers
/// k = 200, and 60 in float; a product that is no number still is one that is not there: T_r alone beyond 10^308.
template <class Value>
struct ResidualRatioTracking {
  static constexpr const char* kName = "residual_ratio";
  static constexpr const char* kSummary = "residual ratio tracking: closed-form control times a ratio estimate of the residual";
  static constexpr const char* kSource = "Novak, Selle, Jarosz 2014, Alg. 2";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  ControlChoice choice;
  std::string component = "product";

  void parameters(ParameterVisitor& visit) {
    choice.parameters(visit);
    visit.choice("component", component, {"product", "control", "residual"},
                 "what is estimated: T = T_c T_r, T_c, or T_r = T/T_c");
  }

  bool needs_optical_depth() const { return choice.kind == "ray_average"; }

  void check(const MatterBounds&) const {
    if (choice.kind == "exponential" && !(choice.value > 0 && choice.value_end > 0))
      throw ParameterError("value", "an exponential control needs value and value_end above zero");
  }

  /// A profile of one component is the product of that component's walk with the control: no quantity.
  Guarantee claim(Quantity quantity) const {
    return quantity == Quantity::transmittance_profile && component != "product" ? Guarantee::biased : Guarantee::unbiased;
  }

  SampleRange range() const { return choice.rate_scale < 1 ? SampleRange::any_sign : kRange; }

  struct RayData : MediumRay<Value> {
    Control<Value> control;
    Rates residual;
    bool with_control = true, with_residual = true;
    int roots = 0, roots_in_float = 0;
  };

  void prepare(RayData& ray) const {
    prepare_control<Value>(choice, ray, ray.control, ray.residual);
    ray.with_control = component != "residual";
    ray.with_residual = component != "control";
    const auto roots = [&](int exponents, int spare) {
      const Real powers = ray.control.growth_depth / std::log(Real{2}) / (exponents - spare);
      return powers > 1 ? static_cast<int>(std::ceil(std::log2(powers))) : 0;
    };
    ray.roots = roots(std::numeric_limits<Real>::max_exponent, 200);
    ray.roots_in_float = roots(std::numeric_limits<float>::max_exponent, 60);
  }

  struct Walk {
    Value weight;  ///< estimate of T_r
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk.weight = ray.value(1);
    flight.start(ray.residual);
  }

  auto propose(Walk&, const auto& ray, auto& flight, auto& rng) const { return flight.next(rng, ray.with_residual); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    Value factor = null_ratio(at, Value(extinction - ray.control.at(at.position(), at.piece())));
    for (int i = roots(ray); i > 0; --i) factor = signed_root(factor);
    walk.weight *= factor;
  }

  Value result(const Walk& walk, const auto& ray) const {
    if (!ray.with_control) return product(ray.value(0), walk.weight, roots(ray));
    return product(Value(-ray.control.depth), walk.weight, roots(ray));
  }

  Value transmittance_at(const Walk& walk, const RayData& ray, Real distance) const {
    return product(Value(-ray.control.depth_to(distance)), walk.weight, roots(ray));
  }

  Value expected(const Value& tau, const RayData& ray) const {
    const Value residual = ray.with_residual ? Value(tau - ray.control.depth) : ray.value(0);
    return exponential(Value(ray.with_control ? Value(-residual - ray.control.depth) : Value(-residual)));
  }

  /// The residual's partial expectations: E[X; K = k] = T_c e^{-M} (int (mubr - (mu - mu_c)))^k / k!, M = int mubr.
  CountLaw count_law(const RayData& ray, const RayProfile& profile, int c) const {
    const Real depth = ray.residual.total_depth();
    const auto moment = [&](int power) {
      return profile.integrate(c, [&](const RayProfile::Node& at) {
        const Real rest = at.extinction - channel(ray.control.at(at.t, at.piece), c), rate = ray.residual.rate(at.piece);
        return rate > 0 ? rate * std::pow((rate - rest) / rate, power) : 0;
      }) / depth;
    };
    const Real control = ray.with_control ? std::exp(-channel(ray.control.depth, c)) : 1;
    return {ray.with_residual ? depth : 0, control, moment(1), moment(2)};
  }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    if (!ray.with_residual) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Real spread = profile.integrate(c, [&](const RayProfile::Node& at) {
      const Real rest = at.extinction - channel(ray.control.at(at.t, at.piece), c), rate = ray.residual.rate(at.piece);
      return rate > 0 ? rest * rest / rate : 0;
    });
    const Real log_mean = -profile.optical_depth(c) + (ray.with_control ? 0 : channel(ray.control.depth, c));
    const Real lookups = ray.residual.total_depth();
    return {.variance = product_variance(log_mean, spread), .lookups = lookups, .lookups_variance = lookups};
  }

 private:
  static int roots(const auto& ray) { return kInFloat<Value> ? ray.roots_in_float : ray.roots; }

  /// e^log_control W, given the 2^roots-th root of W.
  static Value product(const Value& log_control, const Value& root, int roots) {
    if (roots == 0) return exponential(log_control) * root;
    Value x = exponential(Value(log_control * std::ldexp(Real{1}, -roots))) * root;
    for (; roots > 0; --roots) x = signed_square(x);
    return x;
  }
};

}  // namespace nullmark
