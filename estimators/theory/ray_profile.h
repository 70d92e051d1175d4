#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "media/base/medium.h"
#include "media/base/types.h"

namespace nullmark {

/// e^{2 log_mean} (e^spread - 1), the variance of a product of Poisson many independent weights; also where a factor has left the
/// range of numbers and the product has not.
Real product_variance(Real log_mean, Real spread);

/// The extinction along one ray, sampled so that one-dimensional integrals of it, of the running optical depth and of piecewise
/// constant rates are exact to quadrature error: Gauss-Legendre nodes on panels that are cut at the medium's knots and at segment
/// ends, and finely enough that no panel is deeper than a few units of the majorant.
class RayProfile {
 public:
  static constexpr int kNodes = 8;  ///< per panel

  struct Node {
    Real t;             ///< distance, length
    Real weight;        ///< quadrature weight, length
    std::size_t piece;  ///< segment that holds it
    Real extinction;    ///< mu_c(t)
    Real depth;         ///< int_begin^t mu_c
  };

  /// Evaluates the medium at `count` distances; out[i * channels + c].
  using Lookup = std::function<void(const Real* t, std::size_t count, Real* out)>;

  /// `cuts`: sorted, first = begin, last = end.  `pieces`: ends of the segments.  A panel holds at most `panel_depth` of majorant
  /// depth and there are at most `max_panels`; where that does not suffice, `resolved()` is false and sharply peaked integrals
  /// must not be trusted.
  RayProfile(const Lookup& lookup, int channels, std::span<const Real> cuts, std::span<const Real> piece_ends,
             std::span<const Real> piece_rates);

  bool resolved() const { return resolved_; }
  int channels() const { return channels_; }
  Real begin() const { return begin_; }
  Real end() const { return end_; }
  const std::vector<Node>& nodes(int channel) const { return nodes_[static_cast<std::size_t>(channel)]; }
  Real optical_depth(int channel) const { return total_[static_cast<std::size_t>(channel)]; }

  /// int f dt over the ray, f(node).
  template <class F>
  Real integrate(int channel, F&& f) const {
    Real sum = 0;
    for (const Node& node : nodes(channel)) sum += node.weight * f(node);
    return sum;
  }

  /// The running integrals int_begin^{t_j} f at every node j.
  template <class F>
  std::vector<Real> running(int channel, F&& f) const {
    const std::vector<Node>& all = nodes(channel);
    std::vector<Real> values(all.size());
    for (std::size_t j = 0; j < all.size(); ++j) values[j] = f(all[j]);
    return running(values);
  }
  std::vector<Real> running(const std::vector<Real>& values) const;

  /// Extinction at further points, for estimators that choose their own.
  void extinction(const Real* t, std::size_t count, Real* out) const { lookup_(t, count, out); }
  std::span<const Real> cuts() const { return cuts_; }

 private:
  Lookup lookup_;
  int channels_;
  Real begin_ = 0, end_ = 0;
  bool resolved_ = true;
  std::vector<Real> cuts_, widths_;
  std::vector<std::vector<Node>> nodes_;
  std::vector<Real> total_;
};

}  // namespace nullmark
