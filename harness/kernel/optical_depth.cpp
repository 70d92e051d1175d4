#include "harness/kernel/optical_depth.h"

#include <algorithm>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <limits>

#include "estimators/theory/gauss_points.h"

namespace nullmark {
namespace {

constexpr Real kEpsilon = std::numeric_limits<Real>::epsilon();

}  // namespace

void sorted_knots(const Medium& medium, const Ray& local, std::vector<Real>& out) {
  out.assign(1, local.begin);
  if (!(local.length() > 0)) return;
  medium.knots(local, out);
  std::sort(out.begin() + 1, out.end());
  out.push_back(local.end);
  out.erase(std::unique(out.begin(), out.end()), out.end());
}

DepthWithError optical_depth(const Medium& medium, const Ray& local) {
  const int channels = medium.channels();
  if (!(local.length() > 0)) return {Spectrum::Zero(channels), Spectrum::Zero(channels), "closed_form"};
  if (const auto depth = medium.optical_depth(local)) {
    return {*depth, Spectrum(64 * kEpsilon * *depth), "closed_form"};
  }
  std::vector<Real> knots;
  sorted_knots(medium, local, knots);
  const auto pieces = static_cast<Real>(knots.size() - 1);
  std::array<Real, kMaxChannels> mu{};
  const auto lookup = [&](Real t) {
    const Vec3 p = local.at(t);
    medium.extinction({&p.x(), &p.y(), &p.z(), 1}, mu.data());
  };
  if (const auto degree = medium.polynomial_degree()) {
    Eigen::Array<long double, Eigen::Dynamic, 1, Eigen::DontAlign, kMaxChannels, 1> sum(channels);
    sum.setZero();
    const GaussRule& rule = gauss_rule(*degree);
    for (std::size_t i = 0; i + 1 < knots.size(); ++i)
      for (std::size_t point = 0; point < rule.point.size(); ++point) {
        const Real width = knots[i + 1] - knots[i];
        lookup(knots[i] + width * rule.point[point]);
        for (int c = 0; c < channels; ++c)
          sum[c] +=
              static_cast<long double>(width * rule.weight[point]) * static_cast<long double>(mu[static_cast<std::size_t>(c)]);
      }
    const Spectrum depth = sum.cast<Real>();
    return {depth, Spectrum(8 * kEpsilon * (1 + std::sqrt(pieces)) * depth), "exact_traversal"};
  }
  using Rule = boost::math::quadrature::gauss_kronrod<Real, 15>;
  Spectrum depth = Spectrum::Zero(channels), error = Spectrum::Zero(channels);
  for (int c = 0; c < channels; ++c) {
    for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
      Real piece_error = 0;
      depth[c] += Rule::integrate(
          [&](Real t) {
            lookup(t);
            return mu[static_cast<std::size_t>(c)];
          },
          knots[i], knots[i + 1], 10, 1e-13, &piece_error);
      error[c] += piece_error;
    }
    error[c] += 8 * kEpsilon * pieces * depth[c];
  }
  return {depth, error, "quadrature"};
}

}  // namespace nullmark
