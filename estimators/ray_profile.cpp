#include "estimators/ray_profile.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/legendre.hpp>

namespace nullmark {

Real product_variance(Real log_mean, Real spread) {
  return std::exp(2 * log_mean + spread) * -std::expm1(-spread);
}
namespace {

constexpr int kNodes = RayProfile::kNodes;
constexpr Real kPanelDepth = 2;
constexpr std::size_t kMaxPanels = 16384;

/// Gauss-Legendre rule on [0, 1] with the matrix A of running integrals: int_0^{x_i} f = sum_j A_ij f(x_j), exact to degree
/// kNodes - 1.
struct Rule {
  std::array<Real, kNodes> x{}, w{};
  Eigen::Matrix<Real, kNodes, kNodes> running;

  Rule() {
    using Gauss = boost::math::quadrature::gauss<Real, kNodes>;
    const auto& abscissa = Gauss::abscissa();
    const auto& weight = Gauss::weights();
    constexpr int half = kNodes / 2;
    for (int i = 0; i < half; ++i) {
      const auto k = static_cast<std::size_t>(i);
      x[static_cast<std::size_t>(half - 1 - i)] = (1 - abscissa[k]) / 2;
      x[static_cast<std::size_t>(half + i)] = (1 + abscissa[k]) / 2;
      w[static_cast<std::size_t>(half - 1 - i)] = w[static_cast<std::size_t>(half + i)] = weight[k] / 2;
    }
    // In the Legendre basis: int_{-1}^y P_n = (P_{n+1}(y) - P_{n-1}(y)) / (2n + 1).
    Eigen::Matrix<Real, kNodes, kNodes> values, integrals;
    for (int i = 0; i < kNodes; ++i) {
      const Real y = 2 * x[static_cast<std::size_t>(i)] - 1;
      for (int n = 0; n < kNodes; ++n) {
        values(i, n) = boost::math::legendre_p(n, y);
        integrals(i, n) =
            n == 0 ? (y + 1) / 2 : (boost::math::legendre_p(n + 1, y) - boost::math::legendre_p(n - 1, y)) / (2 * (2 * n + 1));
      }
    }
    running = integrals * values.inverse();
  }
};

const Rule& rule() {
  static const Rule instance;
  return instance;
}

}  // namespace

RayProfile::RayProfile(const Lookup& lookup, int channels, std::span<const Real> cuts, std::span<const Real> piece_ends,
                       std::span<const Real> piece_rates)
    : lookup_(lookup),
      channels_(channels),
      cuts_(cuts.begin(), cuts.end()),
      nodes_(static_cast<std::size_t>(channels)),
      total_(static_cast<std::size_t>(channels), 0) {
  if (cuts.size() < 2 || piece_ends.empty()) return;
  begin_ = cuts.front();
  end_ = cuts.back();
  std::vector<Real> t;
  std::vector<std::size_t> piece_of;
  std::size_t piece = 0;
  std::size_t cut = 0;
  for (Real from = begin_; from < end_;) {
    while (piece + 1 < piece_ends.size() && piece_ends[piece] <= from) ++piece;
    while (cut + 1 < cuts.size() && cuts[cut] <= from) ++cut;
    const Real to = std::min({cuts[cut], piece + 1 < piece_ends.size() ? piece_ends[piece] : end_, end_});
    std::size_t parts = 1;
    if (const Real depth = piece_rates[piece] * (to - from); depth > kPanelDepth) {
      const Real wanted = std::ceil(depth / kPanelDepth);
      const auto room = static_cast<Real>(kMaxPanels > widths_.size() ? kMaxPanels - widths_.size() : 1);
      if (wanted > room) resolved_ = false;
      parts = static_cast<std::size_t>(std::min(wanted, room));
    }
    for (std::size_t part = 0; part < parts; ++part) {
      const Real a = from + (to - from) * (static_cast<Real>(part) / static_cast<Real>(parts));
      const Real b = from + (to - from) * (static_cast<Real>(part + 1) / static_cast<Real>(parts));
      widths_.push_back(b - a);
      for (const Real x : rule().x) {
        t.push_back(a + (b - a) * x);
        piece_of.push_back(piece);
      }
    }
    from = to;
  }
  std::vector<Real> mu(t.size() * static_cast<std::size_t>(channels));
  lookup_(t.data(), t.size(), mu.data());
  std::vector<Real> values(t.size());
  for (std::size_t c = 0; c < nodes_.size(); ++c) {
    for (std::size_t j = 0; j < t.size(); ++j) values[j] = mu[j * nodes_.size() + c];
    const std::vector<Real> depth = running(values);
    nodes_[c].resize(t.size());
    for (std::size_t j = 0; j < t.size(); ++j)
      nodes_[c][j] = {t[j], rule().w[j % kNodes] * widths_[j / kNodes], piece_of[j], values[j], depth[j]};
    total_[c] = integrate(static_cast<int>(c), [](const Node& node) { return node.extinction; });
  }
}

std::vector<Real> RayProfile::running(const std::vector<Real>& values) const {
  std::vector<Real> result(values.size());
  const auto& matrix = rule().running;
  Real before = 0;
  for (std::size_t panel = 0; panel < widths_.size(); ++panel) {
    const std::size_t first = panel * kNodes;
    const Eigen::Map<const Eigen::Matrix<Real, kNodes, 1>> f(values.data() + first);
    Eigen::Map<Eigen::Matrix<Real, kNodes, 1>> out(result.data() + first);
    out = widths_[panel] * matrix.lazyProduct(f);
    out.array() += before;
    for (std::size_t i = 0; i < kNodes; ++i) before += widths_[panel] * rule().w[i] * values[first + i];
  }
  return result;
}

}  // namespace nullmark
