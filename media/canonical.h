#pragma once

#include <cmath>
#include <memory>

#include "media/cosine.h"
#include "media/gaussian_bump.h"
#include "media/gaussian_hole.h"
#include "media/linear.h"
#include "media/polynomial.h"

namespace nullmark {

/// The medium of canonical maps [Novak, Selle, Jarosz 2014; Georgiev et al. 2019]: mu(p) = S(x) f(z/length), 1/length, in the box
/// [0,1] x [0,1] x [0,length].  Rays along z see the same profile f everywhere, and across the picture their transmittance
/// changes: with `ramp` "transmittance" T(x) = from + (to - from) x, so S = -ln T(x) / int f dz; with "extinction" S = from^(1-x)
/// to^x.  Together with the majorant "ray_maximum", whose efficiency changes along y, one picture shows an estimator over both.
/// Closed-form depths of rays perpendicular to x.
class CanonicalMedium final : public Medium {
 public:
  CanonicalMedium(std::shared_ptr<const Medium> profile, bool by_transmittance, Real from, Real to)
      : profile_(std::move(profile)), by_transmittance_(by_transmittance), from_(from), to_(to) {
    const Ray through{{0.5, 0.5, 0}, {0, 0, 1}, 0, profile_->bounds().hi.z()};
    whole_ = (*profile_->optical_depth(through))[0];
  }

  Box bounds() const override { return profile_->bounds(); }

  void extinction(const Points& points, Real* out) const override {
    profile_->extinction(points, out);
    for (std::size_t i = 0; i < points.size; ++i) out[i] *= scale(points.x[i]);
  }

  Extrema extrema(const Box& box) const override {
    Extrema extrema = profile_->extrema(box);
    const Box whole = bounds();
    const Real a = std::clamp(box.lo.x(), whole.lo.x(), whole.hi.x()), b = std::clamp(box.hi.x(), whole.lo.x(), whole.hi.x());
    const auto [least, most] = outward(std::minmax({scale(a), scale(b)}));
    extrema.minimum *= least;
    extrema.average *= scale((a + b) / 2);
    extrema.maximum *= most;
    return extrema;
  }

  void knots(const Ray& ray, std::vector<Real>& t) const override {
    profile_->knots(ray, t);
    append_planes(ray, 0, 0, 1, 16, t);
  }

  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    if (ray.direction.x() != 0) return std::nullopt;
    const std::optional<Spectrum> depth = profile_->optical_depth(ray);
    return depth ? std::optional<Spectrum>(*depth * scale(ray.origin.x())) : std::nullopt;
  }

 private:
  Real scale(Real x) const {
    const Real u = std::clamp<Real>(x, 0, 1);
    if (by_transmittance_) return -std::log(from_ + (to_ - from_) * u) / whole_;
    return std::exp(std::log(from_) * (1 - u) + std::log(to_) * u);
  }

  std::shared_ptr<const Medium> profile_;
  bool by_transmittance_;
  Real from_, to_, whole_ = 1;
};

struct CanonicalMediumSource final : MediumSource {
  static constexpr const char* kName = "canonical";
  static constexpr const char* kSummary = "a profile along z; the transmittance or extinction of its rays changes along x";
  static constexpr const char* kSource = "Novak et al. 2014 and Georgiev et al. 2019, canonical maps";

  std::string profile = "cosine", ramp = "transmittance";
  Real from = 0.99, to = 0.01, length = 1;

  void parameters(ParameterVisitor& visit) override {
    visit.choice("profile", profile, {"constant", "linear", "trapezoid", "parabolic", "cosine", "gaussian_bump", "gaussian_hole"},
                 "f along z: 1, s, 1 + s, s^2, and the registered profiles at their defaults");
    visit.choice("ramp", ramp, {"transmittance", "extinction"},
                 "what changes along x: T linearly, or a factor on f geometrically");
    visit.number("from", from, Range::positive(), "", "T or factor at x = 0");
    visit.number("to", to, Range::positive(), "", "T or factor at x = 1");
    visit.number("length", length, Range::positive(), "length", "of the box along z");
  }

  std::shared_ptr<const Medium> build() const override {
    const bool by_transmittance = ramp == "transmittance";
    if (by_transmittance && !(from <= 1)) throw ParameterError("from", "expected a transmittance in (0, 1]");
    if (by_transmittance && !(to <= 1)) throw ParameterError("to", "expected a transmittance in (0, 1]");
    return std::make_shared<CanonicalMedium>(along_z(), by_transmittance, from, to);
  }

 private:
  std::shared_ptr<const Medium> along_z() const {
    if (profile == "cosine") return built(Cosine{});
    if (profile == "gaussian_bump") return built(GaussianBump{});
    if (profile == "gaussian_hole") return built(GaussianHole{});
    Polynomial polynomial;
    std::vector<Real>& f = polynomial.profile.coefficients;
    if (profile == "constant") f = {1};
    if (profile == "linear") f = {0, 1};
    if (profile == "trapezoid") f = {1, 1};
    return built(polynomial);
  }

  template <class Field>
  std::shared_ptr<const Medium> built(Field field) const {
    field.axis_name = "z";
    field.hi.z() = length;
    field.prepare();
    return std::make_shared<FieldMedium<Field>>(std::move(field));
  }
};

}  // namespace nullmark
