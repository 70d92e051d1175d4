#include "estimators/theory/ray_profile.h"

#include <algorithm>

#include "estimators/theory/panel_rule.h"

namespace nullmark {

Real product_variance(Real log_mean, Real spread) { return std::exp(2 * log_mean + spread) * -std::expm1(-spread); }

namespace {

constexpr Real kPanelDepth = 2;
constexpr std::size_t kMaxPanels = 16384;

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
      for (const Real x : panel_rule().x) {
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
      nodes_[c][j] = {t[j], panel_rule().w[j % kNodes] * widths_[j / kNodes], piece_of[j], values[j], depth[j]};
    total_[c] = integrate(static_cast<int>(c), [](const Node& node) { return node.extinction; });
  }
}

std::vector<Real> RayProfile::running(const std::vector<Real>& values) const {
  std::vector<Real> result(values.size());
  const PanelRule::Square& matrix = panel_rule().running;
  Real before = 0;
  for (std::size_t panel = 0; panel < widths_.size(); ++panel) {
    const std::size_t first = panel * kNodes;
    const Eigen::Map<const Eigen::Matrix<Real, kNodes, 1>> f(values.data() + first);
    Eigen::Map<Eigen::Matrix<Real, kNodes, 1>> out(result.data() + first);
    out = widths_[panel] * matrix.lazyProduct(f);
    out.array() += before;
    for (std::size_t i = 0; i < kNodes; ++i) before += widths_[panel] * panel_rule().w[i] * values[first + i];
  }
  return result;
}

}  // namespace nullmark
