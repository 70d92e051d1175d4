#pragma once

#include <boost/math/quadrature/gauss.hpp>
#include <vector>

#include "media/field.h"

namespace nullmark {

/// A grey medium mu(p) = scale * f(s) that varies along one axis of a box, s = (p[axis] - lo) / (hi - lo) in [0,1].
///
/// `Profile` has `Real value(Real s)` = f(s) >= 0 and `Real integral(Real a, Real b)` = int_a^b f ds in closed form,
/// `std::pair<Real, Real> extrema(Real a, Real b)`, and where they exist `void knots(std::vector<Real>& s)`, `int
/// polynomial_degree()`, `prepare()`. With `optical_depth` tau > 0, scale = tau / (int_0^1 f ds * (hi - lo)): the axis then has
/// the transmittance e^-tau whatever the profile's own amplitude; otherwise scale = 1.
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
  Real scale = 1;

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
    if constexpr (requires { profile.prepare(); }) profile.prepare();
    if (target_depth > 0) {
      const Real whole = profile.integral(0, 1) * (hi[axis] - lo[axis]);
      if (!(whole > 0) || !std::isfinite(whole))
        throw ParameterError("optical_depth",
                             "cannot rescale a profile whose integral is zero or infinite; give optical_depth 0");
      scale = target_depth / whole;
    }
  }

  Box bounds() const { return {lo, hi}; }

  Real coordinate(Real x) const { return std::min<Real>(1, std::max<Real>(0, (x - lo[axis]) / (hi[axis] - lo[axis]))); }

  Real extinction(const Vec3& p) const { return scale * profile.value(coordinate(p[axis])); }

  Extrema extrema(const Box& box) const {
    const Real a = coordinate(box.lo[axis]), b = coordinate(box.hi[axis]);
    const auto [minimum, maximum] = profile.extrema(a, b);
    const Real average = b > a ? profile.integral(a, b) / (b - a) : profile.value(a);
    return Extrema::grey(scale * minimum, scale * average, scale * maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const {
    if constexpr (requires { profile.knots(t); }) {
      std::vector<Real> s;
      profile.knots(s);
      const Real d = ray.direction[axis];
      if (d == 0) return;
      for (const Real knot : s) {
        const Real at = (lo[axis] + knot * (hi[axis] - lo[axis]) - ray.origin[axis]) / d;
        if (at > ray.begin && at < ray.end) t.push_back(at);
      }
    }
  }

  int polynomial_degree() const requires requires(const Profile& p) { p.polynomial_degree(); }
  { return profile.polynomial_degree(); }

  std::optional<Real> optical_depth(const Ray& ray) const {
    const Real a = coordinate(ray.at(ray.begin)[axis]), b = coordinate(ray.at(ray.end)[axis]);
    if (!(ray.length() > 0)) return 0;
    // The antiderivative's difference cancels on rays nearly perpendicular to the axis; there the profile is smooth over [a, b].
    constexpr Real kShort = 1e-3;
    if (a == b) return scale * profile.value(a) * ray.length();
    if (std::abs(b - a) < kShort && !crosses_knot(a, b)) {
      using Rule = boost::math::quadrature::gauss<Real, 15>;
      return scale * ray.length() * Rule::integrate([&](Real u) { return profile.value(a + u * (b - a)); }, 0., 1.);
    }
    return scale * ray.length() * profile.integral(std::min(a, b), std::max(a, b)) / std::abs(b - a);
  }

 private:
  bool crosses_knot(Real a, Real b) const {
    if constexpr (requires(std::vector<Real> & s) { profile.knots(s); }) {
      std::vector<Real> s;
      profile.knots(s);
      return std::any_of(s.begin(), s.end(), [&](Real k) { return k >= std::min(a, b) && k <= std::max(a, b); });
    }
    return false;
  }
};

}  // namespace nullmark
