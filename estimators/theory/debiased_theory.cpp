#include "estimators/theory/debiased_theory.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <numeric>

#include "estimators/theory/log_factorial.h"
#include "estimators/theory/march_law.h"
#include "media/base/lanes.h"

namespace nullmark {
namespace {

/// Gauss rules of a discrete law, by Lanczos with full reorthogonalisation [Golub and Welsch 1969].
class GaussRules {
 public:
  /// Rules of up to `most` nodes; the law outlives them.
  GaussRules(const Law& law, Eigen::Index most)
      : x_(law.x.data(), static_cast<Eigen::Index>(law.x.size())),
        scale_((x_ - law.mean()).abs().maxCoeff()),
        basis_(x_.size(), std::min(most, x_.size())),
        diagonal_(basis_.cols()),
        below_(basis_.cols()),
        next_(Eigen::Map<const Eigen::ArrayXd>(law.w.data(), x_.size()).sqrt()) {}

  /// The rule of so many nodes; of fewer where those reproduce the law.  Sizes asked for ascend.
  Law rule(Eigen::Index size) {
    while (used_ < std::min(size, basis_.cols()) && grow()) {
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(diagonal_.head(used_), below_.head(std::max<Eigen::Index>(0, used_ - 1)));
    Law rule;
    for (Eigen::Index i = 0; i < used_; ++i) {
      rule.x.push_back(solver.eigenvalues()[i]);
      rule.w.push_back(solver.eigenvectors()(0, i) * solver.eigenvectors()(0, i));
    }
    return rule;
  }

 private:
  bool grow() {
    const Real norm = next_.norm();
    if (used_ > 0) {
      below_[used_ - 1] = norm;
      if (!(norm > 1e-10 * scale_)) return false;
    }
    basis_.col(used_) = next_ / norm;
    next_ = basis_.col(used_).array() * x_;
    diagonal_[used_] = basis_.col(used_).dot(next_);
    for (int twice = 0; twice < 2; ++twice)
      for (Eigen::Index j = 0; j <= used_; ++j) next_ -= basis_.col(j).dot(next_) * basis_.col(j);
    ++used_;
    return true;
  }

  Eigen::Map<const Eigen::ArrayXd> x_;
  Real scale_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd diagonal_, below_, next_;
  Eigen::Index used_ = 0;
};

constexpr int kMostOrder = 28;

/// SeriesCoefficients of a polynomial in s, by their power; as many as fill whole registers, and a 0.
constexpr std::size_t kPowers = 32;
static_assert(kPowers > kMostOrder);
using SeriesCoefficients = std::array<Real, kPowers + 1>;

/// Weight of the k-th mean of symmetric products of n differences, for all k <= n.
SeriesCoefficients series_weights(int n) {
  SeriesCoefficients weight{1};
  Real choose = 1;
  for (int k = 1; k <= n; ++k) {
    choose *= static_cast<Real>(n - k + 1) / k;
    weight[static_cast<std::size_t>(k)] = 20 * std::exp2(-k) / choose;
  }
  return weight;
}

/// E[e_k e_l] of N pairs (X - x, X - z), for all k, l <= N: coefficients of (1 + s a + t b + s t c)^N.
class SymmetricMoments {
 public:
  SymmetricMoments(Real a, Real b, Real c) : a_(a), b_(b), c_(c) { power(0)[0] = 1; }

  void add_one() {
    ++count_;
    // Downwards, so that what is read has not been replaced.
    for (std::size_t l = count_ + 1; l-- > 0;)
      for (std::size_t block = count_ / kWidth + 1; block-- > 0;) {
        Real* const own = power(l) + block * kWidth;
        Pack sum = Pack::load(own) + Pack(a_) * Pack::load(own - 1);
        if (l > 0) {
          const Real* const before = power(l - 1) + block * kWidth;
          sum += Pack(b_) * Pack::load(before) + Pack(c_) * Pack::load(before - 1);
        }
        sum.store(own);
      }
  }

  /// E[sum_k a_k m_k sum_l a_l m_l], m_k over n differences, of weights a: the N others and, where N = n - 1, the pivots' own.
  Real series(const SeriesCoefficients& weight, Real first, Real second) const {
    SeriesCoefficients sums{};
    for (std::size_t l = 0; l <= count_; ++l) {
      const Pack factor(weight[l] + second * weight[l + 1]);
      for (std::size_t k = 0; k <= count_; k += kWidth)
        (Pack::load(&sums[k]) + factor * Pack::load(power(l) + k)).store(&sums[k]);
    }
    return sum_in_lanes<Real>(count_ + 1, [&](std::size_t k, auto pack) {
      using P = decltype(pack);
      return std::array{(P::load(&weight[k]) + P(first) * P::load(&weight[k + 1])) * P::load(&sums[k])};
    })[0];
  }

 private:
  static constexpr std::size_t kWidth = kNativeLanes<Real>;
  using Pack = Lanes<Real, kWidth>;

  /// SeriesCoefficients of t^l by powers of s; one below the first is 0.
  Real* power(std::size_t l) { return &at_[l * (kPowers + 1) + 1]; }
  const Real* power(std::size_t l) const { return &at_[l * (kPowers + 1) + 1]; }

  Real a_, b_, c_;
  std::size_t count_ = 0;
  std::array<Real, kPowers*(kPowers + 1) + 1> at_{};
};

/// p(n) of the roulette, by n, and what is left of it.
using OrderChances = std::array<Real, kMostOrder + 1>;

/// First and second moment of a march's answer over e^{-tau}, by a rule for the law of the march's error.
std::pair<Real, Real> pivoted_moments(const Law& rule, const OrderChances& chance, int orders) {
  static const auto kWeights = [] {
    std::array<SeriesCoefficients, kMostOrder + 1> weights;
    for (int n = 0; n <= kMostOrder; ++n) weights[static_cast<std::size_t>(n)] = series_weights(n);
    return weights;
  }();
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
        const SeriesCoefficients& weights = kWeights[static_cast<std::size_t>(n)];
        if (n > 0) {
          if (p > 0) square += n * p * both * others.series(weights, z - x, x - z);
          others.add_one();
        }
        if (i == j) {
          square += p * rule.w[i] * exponential(2 * x) * others.series(weights, 0, 0);
          Real terms = 1;
          for (int k = 1; k <= n; ++k) terms += 20 * std::pow(a / 2, k);
          first += (n + 1) * p * rule.w[i] * exponential(x) * terms;
        }
      }
    }
  return {first, square};
}

/// Means over the offsets of one level of Telescoping, of chance p: p (base - truth + difference/p)^2, difference^2/p, base and
/// march.  mu holds the extinctions of `steps` steps of one offset after the other, w the offsets' weights.
std::array<Real, 4> level_moments(std::vector<Real> mu, const std::vector<Real>& w, std::size_t steps, Real length, Real truth,
                                  Real p) {
  constexpr std::size_t kWidth = kNativeLanes<Real>;
  mu.resize((mu.size() + kWidth - 1) / kWidth * kWidth);
  std::vector<Real> thin(mu.size());
  for (std::size_t i = 0; i < mu.size(); i += kWidth)
    exponential(Lanes<Real, kWidth>(-length) * Lanes<Real, kWidth>::load(&mu[i])).store(&thin[i]);
  const Real step = 1 / static_cast<Real>(steps);
  std::vector<Real> base(w.size()), even(w.size()), odd(w.size());
  for (std::size_t i = 0; i < w.size(); ++i) {
    for (std::size_t j = i * steps; j < (i + 1) * steps; j += 2) {
      base[i] += thin[j] + thin[j + 1];
      even[i] += mu[j];
      odd[i] += mu[j + 1];
    }
    base[i] *= step;
  }
  return sum_in_lanes<Real>(w.size(), [&](std::size_t i, auto pack) {
    using Pack = decltype(pack);
    const Pack weight = Pack::load(&w[i]), own = Pack::load(&base[i]), half(2 * step * length);
    const Pack evens = half * Pack::load(&even[i]), odds = half * Pack::load(&odd[i]);
    const Pack difference = march_difference(evens, odds), error = own - Pack(truth) + difference * Pack(1 / p);
    return std::array{weight * Pack(p) * error * error, weight * difference * difference * Pack(1 / p), weight * own,
                      weight * exponential((evens + odds) * Pack(-.5))};
  });
}

}  // namespace

// One derivation, read from top to bottom.
std::optional<Real> unbiased_march_variance(const RayProfile& profile, int c, Real steps, bool endpoint_matching) {
  if (has_constant_extinction(profile, c)) return 0;
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
  OrderChances chance{0.9, 0, 0.1};
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
  // Orders up to a chance of 10^-12, and on until a difference y has lost its weight (y^n/n!)^2/P_n = 20 (y^2/2)^n/n!.
  constexpr int kFewestOrders = 18;
  constexpr Real kLost = 1e-9;
  const Real y = *most - *least;
  int orders = kFewestOrders;
  while (20 * std::exp(orders * std::log(y * y / 2) - log_factorial(orders) + 2 * *most) > kLost)
    if (++orders > kMostOrder) return std::nullopt;
  // The cost grows with the square of the rule's size, and most laws are resolved by a small one.
  constexpr Real kResolved = 1e-9;
  constexpr Eigen::Index kMostPivots = 16;
  GaussRules rules(*depth, kMostPivots);
  const Real mass = std::accumulate(chance.begin(), chance.begin() + orders, Real{0});
  Real before = kInfinity;
  for (const Eigen::Index pivots : {Eigen::Index{4}, Eigen::Index{8}, kMostPivots}) {
    const auto [first, square] = pivoted_moments(rules.rule(pivots), chance, orders);
    // The mean is 1 where the rule resolves the law and no order is missing.  About 1, what is missing hardly counts.
    const Real found = std::max<Real>(0, square - 2 * first + mass);
    if (std::abs(first - 1) < 1e-6 && (pivots == kMostPivots || std::abs(found - before) <= kResolved * found))
      return scale * found;
    before = found;
  }
  return std::nullopt;
}

std::optional<Real> telescoping_variance(const RayProfile& profile, int c, Real r) {
  if (has_constant_extinction(profile, c)) return 0;
  constexpr int kMostLevels = 14;
  constexpr Real kRemainder = 1e-4, kGone = 1e-6;
  const Real truth = std::exp(-profile.optical_depth(c)), length = profile.end() - profile.begin();
  Real variance = 0, before = kInfinity, fall = kInfinity;
  for (int n = 0; n < kMostLevels; ++n) {
    const Real count = std::exp2(n + 1), p = r * std::pow(1 - r, n);
    const auto nodes = offset_nodes(profile, count, fine_parts(count));
    if (!nodes) return std::nullopt;
    const auto [errors, squares, base_mean, march_mean] =
        level_moments(combs(profile, c, count, nodes->x), nodes->w, static_cast<std::size_t>(count), length, truth, p);
    variance += errors;
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

}  // namespace nullmark
