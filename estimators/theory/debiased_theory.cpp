#include "estimators/theory/debiased_theory.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "estimators/theory/log_factorial.h"
#include "estimators/theory/march_theory.h"

namespace nullmark {
namespace {

using Complex = std::complex<Real>;

/// Nodes of an offset so close that narrow features are seen by short marches as well: so many steps at least.
constexpr int kFine = 64;
int fine_parts(Real steps) { return static_cast<int>(std::max<Real>(1, std::ceil(kFine / steps))); }

/// Whether the extinction is the same everywhere, as far as the profile has looked.
bool constant(const RayProfile& profile, int c) {
  const auto& nodes = profile.nodes(c);
  return std::all_of(nodes.begin(), nodes.end(), [&](const auto& node) { return node.extinction == nodes[0].extinction; });
}

/// mu((i + o) h) of every step i of one march after the other.
std::vector<Real> combs(const RayProfile& profile, int c, Real steps, const std::vector<Real>& offsets) {
  const Real h = (profile.end() - profile.begin()) / steps;
  std::vector<Real> t;
  for (const Real o : offsets)
    for (int i = 0; i < steps; ++i) t.push_back(profile.begin() + (i + o) * h);
  return extinction_at(profile, c, t);
}

/// Values of a random variable and their probabilities.
struct Law {
  std::vector<Real> x, w;

  Real mean() const {
    Real sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * x[i];
    return sum;
  }
  Real variance() const {
    const Real m = mean();
    Real sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * (x[i] - m) * (x[i] - m);
    return sum;
  }
};

/// Optical depth of a march whose steps share one offset; with the linear trend taken out where `slope` is its mu(d) - mu(0).
std::optional<Law> uniform_law(const RayProfile& profile, int c, Real steps, Real slope = 0) {
  const auto nodes = offset_nodes(profile, steps, fine_parts(steps));
  if (!nodes) return std::nullopt;
  const Real h = (profile.end() - profile.begin()) / steps;
  const auto k = static_cast<std::size_t>(steps);
  const std::vector<Real> mu = combs(profile, c, steps, nodes->x);
  Law law{{}, nodes->w};
  for (std::size_t i = 0; i < nodes->x.size(); ++i) {
    Real sum = 0;
    for (std::size_t j = 0; j < k; ++j) sum += mu[i * k + j];
    law.x.push_back(h * (sum + slope * (.5 - nodes->x[i])));
  }
  return law;
}

/// Gauss rule of a discrete law, by Lanczos with full reorthogonalisation [Golub and Welsch 1969].
Law gauss_rule(const Law& law, Eigen::Index size) {
  const auto n = static_cast<Eigen::Index>(law.x.size());
  size = std::min(size, n);
  const Eigen::Map<const Eigen::ArrayXd> x(law.x.data(), n), w(law.w.data(), n);
  Eigen::MatrixXd basis(n, size);
  Eigen::VectorXd diagonal(size), below(size);
  Eigen::VectorXd next = w.sqrt();
  const Real scale = (x - law.mean()).abs().maxCoeff();
  Eigen::Index used = 0;
  for (; used < size; ++used) {
    const Real norm = next.norm();
    if (used > 0) {
      below[used - 1] = norm;
      if (!(norm > 1e-10 * scale)) break;
    }
    basis.col(used) = next / norm;
    next = basis.col(used).array() * x;
    diagonal[used] = basis.col(used).dot(next);
    for (int twice = 0; twice < 2; ++twice)
      for (Eigen::Index j = 0; j <= used; ++j) next -= basis.col(j).dot(next) * basis.col(j);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal.head(used), below.head(std::max<Eigen::Index>(0, used - 1)));
  Law rule;
  for (Eigen::Index i = 0; i < used; ++i) {
    rule.x.push_back(solver.eigenvalues()[i]);
    rule.w.push_back(solver.eigenvectors()(0, i) * solver.eigenvectors()(0, i));
  }
  return rule;
}

constexpr int kMostOrder = 28;

/// E[e_k e_l] of N pairs (X - x, X - z), for all k, l <= N: coefficients of (1 + s a + t b + s t c)^N.
class SymmetricMoments {
 public:
  SymmetricMoments(Real a, Real b, Real c) : a_(a), b_(b), c_(c) { at_[0][0] = 1; }

  void add_one() {
    ++count_;
    for (std::size_t k = count_; k <= count_; --k)
      for (std::size_t l = count_; l <= count_; --l)
        at_[k][l] +=
            (k > 0 ? a_ * at_[k - 1][l] : 0) + (l > 0 ? b_ * at_[k][l - 1] : 0) + (k > 0 && l > 0 ? c_ * at_[k - 1][l - 1] : 0);
  }

  /// E[sum_k a_k m_k sum_l a_l m_l], m_k over n differences: the N others and, where N = n - 1, the pivots' own.
  Real series(int n, Real first, Real second) const {
    std::array<Real, kMostOrder + 1> weight{1};
    Real choose = 1;
    for (int k = 1; k <= n; ++k) {
      choose *= static_cast<Real>(n - k + 1) / k;
      weight[static_cast<std::size_t>(k)] = 20 * std::exp2(-k) / choose;
    }
    Real sum = 0;
    for (std::size_t k = 0; k <= static_cast<std::size_t>(n); ++k)
      for (std::size_t l = 0; l <= static_cast<std::size_t>(n); ++l)
        sum += weight[k] * weight[l] *
               (at_[k][l] + (k > 0 ? first * at_[k - 1][l] : 0) + (l > 0 ? second * at_[k][l - 1] : 0) +
                (k > 0 && l > 0 ? first * second * at_[k - 1][l - 1] : 0));
    return sum;
  }

 private:
  Real a_, b_, c_;
  std::size_t count_ = 0;
  std::array<std::array<Real, kMostOrder + 1>, kMostOrder + 1> at_{};
};

}  // namespace

Real jackknife_factor(int m, Real s) {
  if (m == 2) return std::cos(s);
  if (m == 4) return s > 0 ? std::sin(s) / s : 1;
  return std::isfinite(s) ? boost::math::cyl_bessel_j(0, s) : s;
}

std::optional<Real> unbiased_march_variance(const RayProfile& profile, int c, Real steps, bool endpoint_matching) {
  if (constant(profile, c)) return 0;
  const Real tau = profile.optical_depth(c), scale = std::exp(-2 * tau);
  if (!(scale > std::numeric_limits<Real>::min())) return std::nullopt;
  Real slope = 0;
  if (endpoint_matching) {
    const std::vector<Real> ends = extinction_at(profile, c, {profile.begin(), profile.end()});
    slope = ends[1] - ends[0];
    const bool affine = std::all_of(profile.nodes(c).begin(), profile.nodes(c).end(), [&](const auto& node) {
      const Real line = ends[0] + slope * (node.t - profile.begin()) / (profile.end() - profile.begin());
      return std::abs(node.extinction - line) <= 1e-14 * std::max(ends[0], ends[1]);
    });
    if (affine) return 0;
  }
  std::optional<Law> depth = uniform_law(profile, c, steps, slope);
  if (!depth) return std::nullopt;
  for (Real& x : depth->x) x = tau - x;
  // p(n) of the roulette, and what pivots add at first order: the mean of n + 1 marches.
  std::array<Real, kMostOrder + 1> chance{0.9, 0, 0.1};
  for (std::size_t n = 3; n <= kMostOrder; ++n) chance[n] = chance[n - 1] * 2 / static_cast<Real>(n);
  for (std::size_t n = 2; n < kMostOrder; ++n) chance[n] -= chance[n + 1];
  const Real spread = depth->variance();
  constexpr Real kFirstOrder = 1e-12;
  if (spread < kFirstOrder) {
    Real share = 0;
    for (std::size_t n = 0; n < kMostOrder; ++n) share += chance[n] / static_cast<Real>(n + 1);
    return scale * spread * share;
  }
  const auto [least, most] = std::minmax_element(depth->x.begin(), depth->x.end());
  // Orders up to a chance of 10^-14, and on until a difference y has lost its weight (y^n/n!)^2/P_n = 20 (y^2/2)^n/n!.
  constexpr int kFewestOrders = 21;
  constexpr Real kLost = 1e-9;
  const Real y = *most - *least;
  int orders = kFewestOrders;
  while (20 * std::exp(orders * std::log(y * y / 2) - log_factorial(orders) + 2 * *most) > kLost)
    if (++orders > kMostOrder) return std::nullopt;
  constexpr Eigen::Index kPivots = 16;
  const Law rule = gauss_rule(*depth, kPivots);
  const Real mean = rule.mean(), variance = rule.variance();
  Real square = 0, first = 0;
  const auto pivots = rule.x.size();
  for (std::size_t i = 0; i < pivots; ++i)
    for (std::size_t j = i; j < pivots; ++j) {
      const Real x = rule.x[i], z = rule.x[j], a = mean - x, b = mean - z;
      SymmetricMoments others(a, b, variance + a * b);
      const Real both = rule.w[i] * rule.w[j] * exponential(x + z) * (i == j ? 1 : 2);
      for (int n = 0; n < orders; ++n) {
        const Real p = chance[static_cast<std::size_t>(n)] / (n + 1);
        if (n > 0) {
          if (p > 0) square += n * p * both * others.series(n, z - x, x - z);
          others.add_one();
        }
        if (i == j) {
          square += p * rule.w[i] * exponential(2 * x) * others.series(n, 0, 0);
          Real terms = 1;
          for (int k = 1; k <= n; ++k) terms += 20 * std::pow(a / 2, k);
          first += (n + 1) * p * rule.w[i] * exponential(x) * terms;
        }
      }
    }
  // The mean is 1 where the rule resolves the law and no order is missing.
  if (!(std::abs(first - 1) < 1e-6)) return std::nullopt;
  return scale * std::max<Real>(0, square - first * first);
}

std::optional<Real> telescoping_variance(const RayProfile& profile, int c, Real r) {
  if (constant(profile, c)) return 0;
  constexpr int kMostLevels = 14;
  constexpr Real kRemainder = 1e-4, kGone = 1e-6;
  const Real truth = std::exp(-profile.optical_depth(c)), length = profile.end() - profile.begin();
  Real variance = 0, before = kInfinity, fall = kInfinity;
  for (int n = 0; n < kMostLevels; ++n) {
    const Real count = std::exp2(n + 1), p = r * std::pow(1 - r, n);
    const auto k = static_cast<std::size_t>(count);
    const auto nodes = offset_nodes(profile, count, fine_parts(count));
    if (!nodes) return std::nullopt;
    const std::vector<Real> mu = combs(profile, c, count, nodes->x);
    Real squares = 0, base_mean = 0, march_mean = 0;
    for (std::size_t i = 0; i < nodes->x.size(); ++i) {
      Real base = 0, even = 0, odd = 0;
      for (std::size_t j = 0; j < k; ++j) {
        base += exponential(-mu[i * k + j] * length) / count;
        (j % 2 == 0 ? even : odd) += mu[i * k + j] * length * 2 / count;
      }
      const Real difference = march_difference(even, odd), error = base - truth + difference / p;
      variance += nodes->w[i] * p * error * error;
      squares += nodes->w[i] * difference * difference / p;
      base_mean += nodes->w[i] * base;
      march_mean += nodes->w[i] * exponential(-(even + odd) / 2);
    }
    const Real fell = fall;
    const bool gone = std::max(squares, before) < kGone * variance;
    fall = squares / before;
    before = squares;
    const Real rest = gone ? squares : squares * fall / (1 - fall);
    if (n < 4 || !(gone || (fall < 0.7 && fell < 0.7 && rest < kRemainder * variance))) continue;
    const Real off = base_mean - truth;
    return variance + rest + std::pow(1 - r, n + 1) * off * off + 2 * off * (truth - march_mean);
  }
  return std::nullopt;
}

namespace {

/// Optical depth of one march as a sum of independent parts, each less its mean.
struct MarchLaw {
  std::vector<Law> parts;
  Real mean = 0, variance = 0;

  void add(Law law) {
    const Real m = law.mean();
    mean += m;
    for (Real& x : law.x) x -= m;
    variance += law.variance();
    parts.push_back(std::move(law));
  }

  /// log E e^{s (X - E X)}, in a form that does not cancel.
  Complex log_characteristic(Complex s) const;
};

/// e^s - 1 without cancellation.
Complex complex_expm1(Complex s) {
  const Real half = std::sin(s.imag() / 2);
  return {std::expm1(s.real()) * std::cos(s.imag()) - 2 * half * half, std::exp(s.real()) * std::sin(s.imag())};
}

Complex complex_log1p(Complex z) { return {std::log1p(2 * z.real() + std::norm(z)) / 2, std::arg(Real{1} + z)}; }

Complex MarchLaw::log_characteristic(Complex s) const {
  Complex sum = 0;
  for (const Law& law : parts) {
    Complex z = 0;
    for (std::size_t i = 0; i < law.x.size(); ++i) z += law.w[i] * complex_expm1(s * law.x[i]);
    sum += complex_log1p(z);
  }
  return sum;
}

/// phi(real + i u) - 1 of a march for |u| <= 1, by its Chebyshev interpolant: phi is entire, and the march is asked for it often.
class Characteristic {
 public:
  Characteristic(const MarchLaw& march, Real real) {
    for (std::size_t k = 0; k < kPoints; ++k) {
      const Real angle = std::numbers::pi * (static_cast<Real>(k) + .5) / kPoints;
      u_[k] = std::cos(angle);
      weight_[k] = (k % 2 == 0 ? 1 : -1) * std::sin(angle);
      value_[k] = k < kPoints / 2 ? complex_expm1(march.log_characteristic({real, u_[k]})) : std::conj(value_[kPoints - 1 - k]);
    }
  }

  Complex operator()(Real u) const {
    Complex above = 0;
    Real below = 0;
    for (std::size_t k = 0; k < kPoints; ++k) {
      if (u == u_[k]) return value_[k];
      const Real w = weight_[k] / (u - u_[k]);
      above += w * value_[k];
      below += w;
    }
    return above / below;
  }

 private:
  static constexpr std::size_t kPoints = 48;
  std::array<Real, kPoints> u_, weight_;
  std::array<Complex, kPoints> value_;
};

/// Nodes on [0, 1] of a Gauss-Legendre rule.
Law legendre() {
  using Rule = boost::math::quadrature::gauss<Real, 12>;
  Law rule;
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i)
    for (const int side : {-1, 1}) {
      rule.x.push_back((1 + side * Rule::abscissa()[i]) / 2);
      rule.w.push_back(Rule::weights()[i] / 2);
    }
  return rule;
}

/// Mean of f(w) over the unit vectors of sum 0 in R^m.
template <class F>
Real over_directions(int m, int points, const F& f) {
  const auto combined = [&](Real a, Real b, Real c) {
    // Orthonormal: (1, -1, 0, 0)/sqrt 2, (1, 1, -2, 0)/sqrt 6, (1, 1, 1, -3)/sqrt 12.
    const Real p = a / std::sqrt(2.), q = b / std::sqrt(6.), r = c / std::sqrt(12.);
    return f(std::array<Real, 4>{p + q + r, -p + q + r, -2 * q + r, -3 * r});
  };
  if (m == 2) return combined(1, 0, 0);  // the other one is conjugate
  Real sum = 0;
  const Law rule = legendre();
  // Opposite vectors are conjugate: half a turn does.
  for (int i = 0; i < points; ++i) {
    const Real turn = std::numbers::pi * (i + .5) / points;
    if (m == 3) {
      sum += combined(std::cos(turn), std::sin(turn), 0) / points;
      continue;
    }
    for (std::size_t j = 0; j < rule.x.size(); ++j) {
      const Real height = 2 * rule.x[j] - 1, around = std::sqrt(1 - height * height);
      sum += rule.w[j] / points * combined(around * std::cos(turn), around * std::sin(turn), height);
    }
  }
  return sum;
}

/// Length of the sum of two unit vectors: 0 or 2; 2 |cos| of a uniform angle; its square uniform.
Law sum_lengths(int m, int points) {
  if (m == 2) return {{0, 2}, {.5, .5}};
  Law law;
  if (m == 3)
    for (int i = 0; i < points; ++i) {
      law.x.push_back(2 * std::cos(std::numbers::pi / 2 * (i + .5) / points));
      law.w.push_back(Real{1} / points);
    }
  else {
    law = legendre();
    for (Real& x : law.x) x = 2 * std::sqrt(x);
  }
  return law;
}

}  // namespace

Theory jackknife_march(const RayProfile& profile, int c, int m, int steps, bool stratified, bool naive) {
  MarchLaw march;
  const Real h = (profile.end() - profile.begin()) / steps;
  if (stratified) {
    const auto [t, w, first] = stratum_nodes(profile, steps);
    const std::vector<Real> mu = extinction_at(profile, c, t);
    for (std::size_t j = 0; j + 1 < first.size(); ++j) {
      Law law;
      for (std::size_t i = first[j]; i < first[j + 1]; ++i) {
        law.x.push_back(h * mu[i]);
        law.w.push_back(w[i] / h);
      }
      march.add(std::move(law));
    }
  } else {
    std::optional<Law> law = uniform_law(profile, c, steps);
    if (!law) return {};
    march.add(std::move(*law));
  }
  const Real transmittance = std::exp(-march.mean);
  if (constant(profile, c)) return {.mean = transmittance, .variance = 0};
  Real first = 0, second = 0;  // E X/e^{-tau} - 1, and of X^2
  if (naive) {
    first = std::expm1(m * march.log_characteristic(-Real{1} / m).real());
    second = std::expm1(m * march.log_characteristic(-Real{2} / m).real());
  } else {
    constexpr Real kWidest = 3;
    const Real width = std::sqrt(march.variance);
    if (!(width < kWidest)) return {};
    const int points = 4 + static_cast<int>(std::ceil(8 * width));
    const auto moment = [&](const Characteristic& phi, Real length) {
      return over_directions(m, points, [&](const std::array<Real, 4>& w) {
        Complex sum = 0;
        for (int j = 0; j < m; ++j)
          sum += complex_log1p(phi(length * w[static_cast<std::size_t>(j)] / std::sqrt(static_cast<Real>(m))));
        return complex_expm1(sum).real();
      });
    };
    const Characteristic once(march, -Real{1} / m), twice(march, -Real{2} / m);
    first = moment(once, 1);
    const Law lengths = sum_lengths(m, points);
    for (std::size_t i = 0; i < lengths.x.size(); ++i) second += lengths.w[i] * moment(twice, lengths.x[i]);
  }
  const Real mean = transmittance * (1 + first);
  const Real variance = transmittance * transmittance * std::max<Real>(0, second - 2 * first - first * first);
  if (!std::isfinite(mean) || !std::isfinite(variance)) return {};
  return {.mean = mean, .variance = variance};
}

}  // namespace nullmark
