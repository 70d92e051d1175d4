#pragma once

#include <boost/math/quadrature/gauss.hpp>
#include <vector>

#include "media/base/field.h"
#include "media/base/lanes.h"

namespace nullmark {

/// int_a^b f ds by the 15-point Gauss rule: exact to rounding where f is smooth over [a, b].
template <class Function>
Real integral_by_rule(const Function& f, Real a, Real b) {
  return (b - a) * boost::math::quadrature::gauss<Real, 15>::integrate([&](Real u) { return f(a + u * (b - a)); }, 0., 1.);
}

/// Bounds from values at the ends of a monotone stretch, a few ulps further apart: exp, log and cos as computed are monotone to
/// rounding only, and the bounds must hold for the values as computed.
inline std::pair<Real, Real> outward(std::pair<Real, Real> bounds) {
  constexpr Real kRounding = 8 * std::numeric_limits<Real>::epsilon();
  return {bounds.first * (1 - kRounding), bounds.second * (1 + kRounding)};
}

/// A grey medium mu(p) = scale * f(s) that varies along one axis of a box, s = (p[axis] - lo) / (hi - lo) in [0,1].
///
/// `Profile` has `Real value(Real s)` = f(s) >= 0, `Real integral(Real a, Real b)` = int_a^b f ds for a < b in closed form and
/// relatively accurate however close a and b are, `std::pair<Real, Real> extrema(Real a, Real b)`, and where they exist `value`
/// as a template over Real and Lanes, `void knots(std::vector<Real>& s)` or the knots sorted, `std::vector<Real> cuts`, which
/// spares samplers that ask for them along every leg of a path an allocation; `int polynomial_degree()`, `prepare()`, `Real
/// fraction_at(Real a, Real b, Real mean)`: the x of int_0^x f(a + (b - a) y) dy = mean, for b on either side of a, where it is
/// below 1. With `optical_depth` tau > 0, scale = tau / (int_0^1 f ds * (hi - lo)): the axis then has the transmittance e^-tau
/// whatever the profile's own amplitude; otherwise scale = 1.
template <class Profile>
struct AlongAxis {
  static constexpr const char* kName = Profile::kName;
  static constexpr const char* kSummary = Profile::kSummary;
  static constexpr const char* kSource = Profile::kSource;

  Profile profile;
  std::string axis_name = "x";
  Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();
  Real target_depth = 0;

  int axis = 0;
  Real scale = 1, inverse_extent = 1;
  bool fits_single = true;  ///< float holds the numbers that the profile is computed by

  void parameters(ParameterVisitor& visit) {
    profile.parameters(visit);
    visit.choice("axis", axis_name, {"x", "y", "z"}, "axis along which the extinction varies");
    visit.number("optical_depth", target_depth, Range::non_negative(), "",
                 "rescales the profile so that the whole axis has this optical depth; 0 leaves it as it is");
    visit.point("lo", lo, "length", "lower corner of the box");
    visit.point("hi", hi, "length", "upper corner of the box");
  }

  void prepare() {
    if (Box{lo, hi}.empty()) throw ParameterError("hi", "box is empty: every component of hi must exceed that of lo");
    axis = axis_name[0] - 'x';
    inverse_extent = 1 / (hi[axis] - lo[axis]);
    if constexpr (requires { profile.prepare(); }) profile.prepare();
    if (target_depth > 0) {
      const Real whole = profile.integral(0, 1) * (hi[axis] - lo[axis]);
      // Below it the profile's own values have lost digits.
      constexpr Real kLeast = 1e-280;
      if (!(whole > kLeast) || !std::isfinite(whole))
        throw ParameterError("optical_depth",
                             "cannot rescale a profile whose integral is below 1e-280 or infinite; give optical_depth 0");
      scale = target_depth / whole;
    }
    fits_single = agrees_in_float();
  }

  Box bounds() const { return {lo, hi}; }

  template <class X>
  X coordinate(const X& x) const {
    return smaller(1, larger(0, (x - lo[axis]) * inverse_extent));
  }

  Real extinction(const Vec3& p) const { return scale * profile.value(coordinate(p[axis])); }

  /// The axis is chosen once for the block.
  template <class T>
  void extinction(const BasicPoints<T>& points, T* out) const {
    const T* x = axis == 0 ? points.x : axis == 1 ? points.y : points.z;
    const auto in_double = [&] {
      for (std::size_t i = 0; i < points.size; ++i) out[i] = static_cast<T>(scale * profile.value(coordinate(Real{x[i]})));
    };
    if constexpr (requires(Lanes<T, 1> s) { profile.value(s); }) {
      if (std::is_same_v<T, float> && !fits_single) return in_double();
      const auto value = [this](auto lanes) { return scale * profile.value(coordinate(lanes)); };
      // Paths look up one point after the other.
      if (points.size == 1)
        value(Lanes<T, 1>::load(x)).store(out);
      else
        map_lanes(x, points.size, out, value);
    } else {
      in_double();
    }
  }

  Extrema extrema(const Box& box) const {
    const Real a = coordinate(box.lo[axis]), b = coordinate(box.hi[axis]);
    const auto [minimum, maximum] = profile.extrema(a, b);
    const Real average = b > a ? std::clamp(profile.integral(a, b) / (b - a), minimum, maximum) : profile.value(a);
    return Extrema::grey(scale * minimum, scale * average, scale * maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const {
    const auto append = [&](const std::vector<Real>& s) {
      for (const Real knot : s) append_crossing(ray, axis, lo[axis] + knot * (hi[axis] - lo[axis]), t);
    };
    if constexpr (requires { profile.cuts; }) {
      append(profile.cuts);
    } else if constexpr (requires(std::vector<Real> s) { profile.knots(s); }) {
      std::vector<Real> s;
      profile.knots(s);
      append(s);
    }
  }

  int polynomial_degree() const requires requires(const Profile& p) { p.polynomial_degree(); }
  { return profile.polynomial_degree(); }

  std::optional<Real> optical_depth(const Ray& ray) const {
    if (!(ray.length() > 0)) return 0;
    if constexpr (requires { profile.polynomial_degree(); })
      if (profile.polynomial_degree() == 0) return sum_of_constant_pieces(ray);
    // The mean over [a, b], not a difference of antiderivatives: on rays nearly perpendicular to the axis b - a has lost most of
    // its digits, but the mean hardly depends on it.
    const Real a = coordinate(ray.at(ray.begin)[axis]), b = coordinate(ray.at(ray.end)[axis]);
    const Real mean = a == b ? profile.value(a) : profile.integral(std::min(a, b), std::max(a, b)) / std::abs(b - a);
    return scale * mean * ray.length();
  }

  std::optional<Real> distance_at_depth(const Ray& ray, Real depth) const requires requires(const Profile& p, Real x) {
    p.fraction_at(x, x, x);
  }
  {
    if (!(depth < *optical_depth(ray))) return kInfinity;
    const Real a = coordinate(ray.at(ray.begin)[axis]), b = coordinate(ray.at(ray.end)[axis]);
    const Real fraction = profile.fraction_at(a, b, depth / (scale * ray.length()));
    return std::min(ray.end, ray.begin + fraction * ray.length());
  }

 private:
  /// Whether the profile as computed in float is that in double along the axis.  Where amplitude and bell, or scale and profile,
  /// leave the range of float apart, their product may be infinite, none or not a number.
  bool agrees_in_float() const {
    if constexpr (requires(Lanes<float, 1> s) { profile.value(s); }) {
      constexpr int kPoints = 64;
      constexpr Real kRounding = 1e-2, kNothing = 1e-6;
      const Real most = scale * profile.extrema(0, 1).second;
      for (int i = 0; i <= kPoints; ++i) {
        const auto s = static_cast<float>(i) / kPoints;
        float single = 0;
        (scale * profile.value(Lanes<float, 1>::load(&s))).store(&single);
        const Real exact = scale * profile.value(Real{s});
        if (!(std::abs(single - exact) <= kRounding * exact + kNothing * most)) return false;
      }
    }
    return true;
  }

  // A mean does depend on b - a where f jumps between them; lengths from knot to knot do not.
  Real sum_of_constant_pieces(const Ray& ray) const {
    Real sum = 0, from = ray.begin;
    const auto add_to = [&](Real t) {
      sum += extinction(ray.at((from + t) / 2)) * (t - from);
      from = t;
    };
    if constexpr (requires { profile.cuts; }) {
      const Real d = ray.direction[axis];
      for (std::size_t i = 0; d != 0 && i < profile.cuts.size(); ++i) {
        const Real cut = d > 0 ? profile.cuts[i] : profile.cuts[profile.cuts.size() - 1 - i];
        const Real t = (lo[axis] + cut * (hi[axis] - lo[axis]) - ray.origin[axis]) / d;
        if (t > ray.begin && t < ray.end) add_to(t);
      }
    } else {
      std::vector<Real> t;
      knots(ray, t);
      std::sort(t.begin(), t.end());
      for (const Real knot : t) add_to(knot);
    }
    add_to(ray.end);
    return sum;
  }
};

}  // namespace nullmark
