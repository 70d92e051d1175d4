#include "estimators/theory/guided_theory.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/theory/kinks.h"
#include "estimators/theory/panel_rule.h"
#include "media/base/lanes.h"

namespace nullmark {
namespace {

constexpr int kNodes = RayProfile::kNodes;
using Square = PanelRule::Square;
using Column = Eigen::Matrix<Real, kNodes, 1>;

/// The profile cut where q reaches its least value, and finely.
RayProfile refined(const Rates& majorant, const RayProfile& profile, Real least) {
  Rates level;
  level.start(majorant.begin());
  for (std::size_t i = 0; i < majorant.size(); ++i) level.append(majorant.end(i), (1 - least) * majorant.rate(i));
  const RayProfile at_kinks = cut_at_levels(profile, majorant, {&level});
  std::vector<Real> cuts(at_kinks.cuts().begin(), at_kinks.cuts().end());
  constexpr int kParts = 16;
  for (int i = 1; i < kParts; ++i) cuts.push_back(profile.begin() + (profile.end() - profile.begin()) * i / kParts);
  return cut_anew(profile, std::move(cuts), majorant);
}

}  // namespace

// One derivation, read from top to bottom: its parts share every array.
Theory guided_moments(const Rates& majorant, const RayProfile& profile, int c, Real least, bool start_looked_up) {
  constexpr Real kDeepest = 40;
  const Real total = majorant.total_depth();
  if (!(total > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
  if (total > kDeepest) return {};
  const Square& tail = panel_rule().ahead;
  const RayProfile fine = refined(majorant, profile, least);
  const std::vector<RayProfile::Node>& nodes = fine.nodes(c);
  const std::size_t count = nodes.size();
  constexpr std::size_t kMostNodes = 8000;
  if (count > kMostNodes) return {};

  // Of every node: depth, weight in depth, a of this channel, q of the thinnest.
  const std::vector<Real> depth = fine.running(c, [&](const RayProfile::Node& at) { return majorant.rate(at.piece); });
  std::vector<Real> weight(count), null(count, 0), rate(count, 1);
  for (std::size_t j = 0; j < count; ++j) {
    const Real bound = majorant.rate(nodes[j].piece);
    weight[j] = bound * nodes[j].weight;
    if (!(bound > 0)) continue;
    null[j] = (bound - nodes[j].extinction) / bound;
    Real thinnest = null[j];
    for (int k = 0; k < fine.channels(); ++k) thinnest = std::max(thinnest, (bound - fine.nodes(k)[j].extinction) / bound);
    rate[j] = std::max(least, thinnest);
  }

  Real first_rate = 1, extra = 0;
  if (start_looked_up) {
    std::size_t piece = 0;
    while (!(majorant.rate(piece) > 0)) ++piece;
    const Real begin = majorant.position(piece, majorant.depth_before(piece));
    std::vector<Real> mu(static_cast<std::size_t>(fine.channels()));
    fine.extinction(&begin, 1, mu.data());
    first_rate = least;
    for (const Real x : mu) first_rate = std::max(first_rate, (majorant.rate(piece) - x) / majorant.rate(piece));
    extra = 1;
  }

  // Of nodes that are done, times their weights: a^2 E[X^2], 1 + E[N], 1 + 2 E[N] + E[N^2] from there on.
  std::vector<Real> square(count), ahead(count), ahead_square(count);
  struct Sums {
    Real square, ahead, ahead_square;
  };
  // What nodes from `from` on add at depth s for the rate q.
  const auto later = [&](Real s, Real q, std::size_t from) {
    constexpr Real kVanished = 40;
    const auto begin = depth.begin() + static_cast<std::ptrdiff_t>(from);
    const auto n = static_cast<std::size_t>(std::upper_bound(begin, depth.end(), s + kVanished / q) - begin);
    const auto sums = sum_in_lanes<Real>(n, [&](std::size_t i, auto pack) {
      using Pack = decltype(pack);
      const Pack ds = Pack::load(&depth[from + i]) - Pack(s), flown = exponential(Pack(-q) * ds);
      return std::array{flown * exponential(Pack(2 * (q - 1)) * ds) * Pack::load(&square[from + i]),
                        flown * Pack::load(&ahead[from + i]), flown * Pack::load(&ahead_square[from + i])};
    });
    return Sums{std::exp((q - 2) * (total - s)) + sums[0] / q, q * sums[1], q * sums[2]};
  };
  for (std::size_t panel = count / kNodes; panel-- > 0;) {
    const std::size_t from = panel * kNodes;
    Real width = 0;
    for (std::size_t j = 0; j < kNodes; ++j) width += weight[from + j];
    Square weights = Square::Identity(), flights = Square::Identity(), kernel;
    Column squares, sum, sum_square;
    for (int i = 0; i < kNodes; ++i) {
      const std::size_t at = from + static_cast<std::size_t>(i);
      const Real q = rate[at];
      const Sums sums = later(depth[at], q, from + kNodes);
      squares[i] = sums.square;
      sum[i] = sums.ahead;
      sum_square[i] = sums.ahead_square;
      for (int j = 0; j < kNodes; ++j) {
        const std::size_t to = from + static_cast<std::size_t>(j);
        const Real ds = depth[to] - depth[at], part = width * tail(i, j);
        weights(i, j) -= part * std::exp((q - 2) * ds) * null[to] * null[to] / q;
        kernel(i, j) = part * q * std::exp(-q * ds);
      }
    }
    flights -= kernel;
    const Eigen::PartialPivLU<Square> solver(flights);
    const Column u = weights.partialPivLu().solve(squares);
    const Column l = solver.solve(sum + kernel * Column::Ones());
    const Column r = solver.solve(sum_square + kernel * (Column::Ones() + 2 * l));
    for (int i = 0; i < kNodes; ++i) {
      const std::size_t at = from + static_cast<std::size_t>(i);
      square[at] = weight[at] * null[at] * null[at] * u[i];
      ahead[at] = weight[at] * (1 + l[i]);
      ahead_square[at] = weight[at] * (1 + 2 * l[i] + r[i]);
    }
  }
  const Sums sums = later(0, first_rate, 0);
  const Real transmittance = std::exp(-profile.optical_depth(c));
  bool exact = true;
  for (std::size_t j = 0; j < count; ++j) exact = exact && (weight[j] == 0 || (rate[j] == first_rate && null[j] == first_rate));
  const Real variance = exact ? 0 : std::max<Real>(0, sums.square - transmittance * transmittance);
  return {.variance = variance,
          .lookups = sums.ahead + extra,
          .lookups_variance = std::max<Real>(0, sums.ahead_square - sums.ahead * sums.ahead)};
}

}  // namespace nullmark
