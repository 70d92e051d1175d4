#pragma once

#include "media/base/field.h"

namespace nullmark {

/// mu(p) = extinction, 1/length, >= 0, in a box: the medium whose transmittance e^(-mu d), variances and lookups are all closed
/// forms (Novak et al. 2014, Georgiev et al. 2019).
struct Homogeneous {
  static constexpr const char* kName = "homogeneous";
  static constexpr const char* kSummary = "constant extinction in a box";
  static constexpr const char* kSource = "Woodcock et al. 1965; Novak et al. 2014";

  Real value = 1;
  Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();

  void parameters(ParameterVisitor& visit) {
    visit.number("extinction", value, Range::non_negative(), "1/length", "extinction everywhere in the box");
    visit.point("lo", lo, "length", "lower corner of the box");
    visit.point("hi", hi, "length", "upper corner of the box");
  }

  void prepare() const {
    if (Box{lo, hi}.empty()) throw ParameterError("hi", "box is empty: every component of hi must exceed that of lo");
  }

  Box bounds() const { return {lo, hi}; }
  template <class T>
  void extinction(const BasicPoints<T>& points, T* out) const {
    std::fill_n(out, points.size, static_cast<T>(value));
  }
  Extrema extrema(const Box&) const { return Extrema::grey(value, value, value); }
  int polynomial_degree() const { return 0; }
  std::optional<Real> optical_depth(const Ray& ray) const { return value * ray.length(); }
  std::optional<Real> distance_at_depth(const Ray& ray, Real depth) const {
    return depth < value * ray.length() ? std::min(ray.end, ray.begin + depth / value) : kInfinity;
  }
};

}  // namespace nullmark
