#pragma once

#include <memory>
#include <string>
#include <utility>

#include "media/base/registry.h"

namespace nullmark {

/// Appends the t in (ray.begin, ray.end) at which the ray crosses the plane p[axis] = x, if it does.
inline void append_crossing(const Ray& ray, int axis, Real x, std::vector<Real>& t) {
  const Real d = ray.direction[axis];
  if (d == 0) return;
  const Real at = (x - ray.origin[axis]) / d;
  if (at > ray.begin && at < ray.end) t.push_back(at);
}

/// The same for the n - 1 planes that cut [lo, hi] into n equal cells.
inline void append_planes(const Ray& ray, int axis, Real lo, Real hi, int n, std::vector<Real>& t) {
  if (ray.direction[axis] == 0) return;
  const auto lattice = [&](Real at) { return std::clamp<Real>((ray.at(at)[axis] - lo) / (hi - lo) * n, 0, n); };
  const auto [a, b] = std::minmax({lattice(ray.begin), lattice(ray.end)});
  const int first = std::max(1, static_cast<int>(a)), last = std::min(n - 1, static_cast<int>(b) + 1);
  for (int i = first; i <= last; ++i) append_crossing(ray, axis, lo + (hi - lo) * i / n, t);
}

/// A grey medium from a plain struct: the author writes `Real extinction(const Vec3&) const` (or, for blocks, `template <class T>
/// void extinction(const BasicPoints<T>&, T* out) const`), `Extrema extrema(const Box&)
/// const`, `Box bounds() const`, and where they exist `void knots(const Ray&, std::vector<Real>&) const`, `int
/// polynomial_degree() const`, `std::optional<Real> optical_depth(const Ray&) const`, `std::optional<Real>
/// distance_at_depth(const Ray&, Real depth) const`; this adaptor makes the block loop with the lookup inlined.
template <class Field>
class FieldMedium final : public Medium {
 public:
  explicit FieldMedium(Field field) : field_(std::move(field)) {}

  Box bounds() const override { return field_.bounds(); }

  void extinction(const Points& points, Real* out) const override {
    if constexpr (requires { field_.extinction(points, out); })
      field_.extinction(points, out);
    else
      for (std::size_t i = 0; i < points.size; ++i) out[i] = field_.extinction(points[i]);
  }

  void extinction(const SinglePoints& points, float* out) const override {
    if constexpr (requires { field_.extinction(points, out); })
      field_.extinction(points, out);
    else
      Medium::extinction(points, out);
  }

  Extrema extrema(const Box& box) const override {
    const Box whole = field_.bounds();
    const Box part = {box.lo.cwiseMax(whole.lo), box.hi.cwiseMin(whole.hi)};
    if ((part.lo.array() > part.hi.array()).any()) return Extrema::grey(0, 0, 0);
    return field_.extrema(part);
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
      // Fields extend their faces' values beyond the box; outside there is vacuum.
      if (const std::optional<Real> depth = field_.optical_depth(clipped(ray, field_.bounds())))
        return Spectrum::Constant(1, *depth);
    }
    return std::nullopt;
  }

  std::optional<Real> distance_at_depth(const Ray& ray, Real depth) const override {
    if constexpr (requires { field_.distance_at_depth(ray, depth); })
      return field_.distance_at_depth(clipped(ray, field_.bounds()), depth);
    else
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
