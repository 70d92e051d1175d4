#pragma once

#include <memory>
#include <string>
#include <utility>

#include "media/registry.h"

namespace nullmark {

/// A grey medium from a plain struct: the author writes `Real extinction(const Vec3&) const`, `Extrema extrema(const Box&)
/// const`, `Box bounds() const`, and where they exist `void knots(const Ray&, std::vector<Real>&) const`, `int
/// polynomial_degree() const`, `std::optional<Real> optical_depth(const Ray&) const`; this adaptor makes the block loop with the
/// lookup inlined.
template <class Field>
class FieldMedium final : public Medium {
 public:
  explicit FieldMedium(Field field) : field_(std::move(field)) {}

  Box bounds() const override { return field_.bounds(); }

  void extinction(const Points& points, Real* out) const override {
    for (std::size_t i = 0; i < points.size; ++i) out[i] = field_.extinction(points[i]);
  }

  Extrema extrema(const Box& box) const override {
    const Box whole = field_.bounds();
    return field_.extrema({box.lo.cwiseMax(whole.lo), box.hi.cwiseMin(whole.hi)});
  }

  void knots(const Ray& ray, std::vector<Real>& t) const override {
    if constexpr (requires { field_.knots(ray, t); }) field_.knots(ray, t);
  }

  std::optional<int> polynomial_degree() const override {
    if constexpr (requires { field_.polynomial_degree(); })
      return field_.polynomial_degree();
    else
      return std::nullopt;
  }

  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    if constexpr (requires { field_.optical_depth(ray); }) {
      if (const std::optional<Real> depth = field_.optical_depth(ray)) return Spectrum::Constant(1, *depth);
    }
    return std::nullopt;
  }

 private:
  Field field_;
};

/// Registers a field struct: its public data members are the parameters, `parameters(visit)` tells them, `prepare()` (optional)
/// checks them against each other and fills what is derived from them.
template <class Field>
class FieldSource final : public MediumSource {
 public:
  static constexpr const char* kName = Field::kName;
  static constexpr const char* kSummary = Field::kSummary;
  static constexpr const char* kSource = Field::kSource;

  void parameters(ParameterVisitor& visit) override { field_.parameters(visit); }

  std::shared_ptr<const Medium> build() const override {
    Field field = field_;
    if constexpr (requires { field.prepare(); }) field.prepare();
    return std::make_shared<FieldMedium<Field>>(std::move(field));
  }

 private:
  Field field_;
};

}  // namespace nullmark
