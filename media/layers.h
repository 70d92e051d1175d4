#pragma once

#include "media/base/along_axis.h"

namespace nullmark {

/// Piecewise constant along an axis: f(s) = values[i], 1/length, for edges[i-1] <= s < edges[i], edges in (0,1), equally spaced
/// unless given.  One step, slabs with vacuum between, thin shells.
///
/// Layers that a box covers by no more than rounding are left out of its bounds: otherwise a majorant grid aligned with the
/// layers would bound each by its neighbours as well.
struct LayersProfile {
  static constexpr const char* kName = "layers";
  static constexpr const char* kSummary = "piecewise constant layers along an axis";
  static constexpr const char* kSource = "a test field of this project";

  std::vector<Real> values = {0.5, 2, 0, 1};
  std::vector<Real> edges;

  std::vector<Real> cuts;  ///< where f jumps: edges with the defaults filled in

  void parameters(ParameterVisitor& visit) {
    visit.numbers("values", values, 1, 4096, Range::non_negative(), "1/length", "extinction of each layer, from below");
    visit.numbers("edges", edges, 0, 4095, Range::between(0, 1), "",
                  "where layers meet, increasing fractions of the axis, one fewer than values; none: equal layers");
  }

  void prepare() {
    if (values.empty()) throw ParameterError("values", "expected at least one layer, found none");
    cuts = edges;
    if (cuts.empty())
      for (std::size_t i = 1; i < values.size(); ++i) cuts.push_back(static_cast<Real>(i) / static_cast<Real>(values.size()));
    if (cuts.size() + 1 != values.size())
      throw ParameterError("edges", std::to_string(values.size()) + " values need " + std::to_string(values.size() - 1) +
                                        " edges, found " + std::to_string(edges.size()) + "; leave edges out for equal layers");
    for (std::size_t i = 0; i < cuts.size(); ++i)
      if (!(cuts[i] > (i > 0 ? cuts[i - 1] : 0) && cuts[i] < 1))
        throw ParameterError("edges", "edge " + std::to_string(i) + " is " + std::to_string(cuts[i]) +
                                          "; expected increasing numbers between 0 and 1, both excluded");
  }

  Real value(Real s) const { return values[layer(s)]; }

  Real integral(Real a, Real b) const {
    Real sum = 0;
    for (std::size_t i = layer(a), last = layer(b); i <= last; ++i)
      sum += values[i] * (std::min(b, upper(i)) - std::max(a, i > 0 ? cuts[i - 1] : 0));
    return sum;
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    constexpr Real kRounding = 8 * std::numeric_limits<Real>::epsilon();
    std::size_t first = layer(a), last = layer(b);
    if (first < last && upper(first) - a <= kRounding) ++first;
    if (first < last && b - cuts[last - 1] <= kRounding) --last;
    const auto range = std::minmax_element(values.begin() + static_cast<std::ptrdiff_t>(first),
                                           values.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    return {*range.first, *range.second};
  }

  int polynomial_degree() const { return 0; }

 private:
  std::size_t layer(Real s) const {
    return static_cast<std::size_t>(std::upper_bound(cuts.begin(), cuts.end(), s) - cuts.begin());
  }
  Real upper(std::size_t i) const { return i < cuts.size() ? cuts[i] : 1; }
};

using Layers = AlongAxis<LayersProfile>;

}  // namespace nullmark
