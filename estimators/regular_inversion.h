#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/gauss_points.h"

namespace nullmark {

/// Free paths by regular tracking [Amanatides and Woo 1987; Kutz et al. 2017, Sec. 2]: the optical depth is summed exactly from
/// knot to knot until it reaches a unit exponential, and inverted in that cell, where the extinction is a polynomial known from
/// as many Gauss points as it has coefficients: safeguarded Newton on its antiderivative.  1 where the walk escapes, Var = T (1 -
/// T). On chromatic media the channels share the exponential and the walk; free paths on grey media.
template <class Value>
struct RegularInversion {
  static constexpr const char* kName = "regular_inversion";
  static constexpr const char* kSummary = "free paths by exact integration from knot to knot, inverted in the cell";
  static constexpr const char* kSource = "Amanatides and Woo 1987; Kutz, Habel, Li, Novak 2017, Sec. 2";
  static constexpr SampleRange kRange = SampleRange::binary;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kNeedsKnots = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    const GaussRule* rule = nullptr;
  };
  void prepare(RayData& ray) const { ray.rule = &gauss_rule(std::min(2 * *ray.degree, kMostDegree)); }

  struct Walk {
    Value depth;
    Real target = 0, before = 0;  ///< the exponential; a grey walk's depth where its cell begins
    std::size_t piece = 0;
    int point = -1;
    Real distance = kInfinity;
    std::array<Real, kMostDegree / 2 + 1> extinction{};  ///< of a grey walk, in its cell
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto& rng) const {
    walk.depth = ray.value(0);
    walk.target = rng.exponential();
    walk.before = 0;
    walk.piece = 0;
    walk.point = -1;
    walk.distance = kInfinity;
  }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto&) const {
    if (++walk.point == ray.rule->size()) {
      if (!(smallest(walk.depth) < walk.target)) {
        if (ray.channels == 1) walk.distance = invert(walk, ray);
        return false;
      }
      walk.point = 0;
      ++walk.piece;
      walk.before = channel(walk.depth, 0);
    }
    if (walk.piece + 1 >= ray.knots.size()) return false;
    const Real a = ray.knots[walk.piece], b = ray.knots[walk.piece + 1];
    flight.jump(a + (b - a) * ray.rule->point[static_cast<std::size_t>(walk.point)]);
    return true;
  }

  void consume(Walk& walk, const RayData& ray, const Flight&, const Value& extinction, auto&) const {
    const auto point = static_cast<std::size_t>(walk.point);
    walk.extinction[point] = channel(extinction, 0);
    walk.depth += extinction * ((ray.knots[walk.piece + 1] - ray.knots[walk.piece]) * ray.rule->weight[point]);
  }

  Value result(const Walk& walk, const RayData& ray) const {
    Value escaped = ray.value(0);
    for (int c = 0; c < ray.channels; ++c) channel(escaped, c) = channel(walk.depth, c) < walk.target;
    return escaped;
  }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight&) const {
    if (walk.distance < kInfinity) return {EventKind::collision, walk.distance, ray.value(1)};
    return {EventKind::escape, ray.end, ray.value(1)};
  }

  /// A cell is looked up whole where the thinnest channel's depth at its beginning is below the exponential.
  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const Real depth = profile.optical_depth(c);
    Theory theory{.variance = std::exp(-depth) * -std::expm1(-depth)};
    Real mean = 0, square = 0;
    std::vector<Real> deep(static_cast<std::size_t>(ray.channels));
    std::size_t j = 0;
    for (std::size_t i = 0; i + 1 < ray.knots.size(); ++i) {
      const Real reached = std::exp(-*std::min_element(deep.begin(), deep.end()));
      mean += reached;
      square += static_cast<Real>(2 * i + 1) * reached;
      for (; j < profile.nodes(0).size() && profile.nodes(0)[j].t < ray.knots[i + 1]; ++j)
        for (std::size_t l = 0; l < deep.size(); ++l) {
          const RayProfile::Node& node = profile.nodes(static_cast<int>(l))[j];
          deep[l] += node.weight * node.extinction;
        }
    }
    const Real points = ray.rule->size();
    theory.lookups = points * mean;
    theory.lookups_variance = points * points * std::max<Real>(0, square - mean * mean);
    return theory;
  }

 private:
  /// The root of int_0^x p = what is left, over the cell's width, with p in Legendre polynomials of 2x - 1.
  static Real invert(const Walk& walk, const RayData& ray) {
    const std::size_t count = ray.rule->point.size();
    std::array<Real, kMostDegree / 2 + 1> coefficient{};
    const Real a = ray.knots[walk.piece], width = ray.knots[walk.piece + 1] - a;
    for (std::size_t i = 0; i < count; ++i) {
      Real p = 1, before = 0;
      const Real z = 2 * ray.rule->point[i] - 1;
      for (std::size_t k = 0; k < count; ++k) {
        const auto n = static_cast<Real>(k);
        coefficient[k] += (2 * n + 1) * ray.rule->weight[i] * walk.extinction[i] * p;
        const Real next = ((2 * n + 1) * z * p - n * before) / (n + 1);
        before = p;
        p = next;
      }
    }
    const Real wanted = (walk.target - walk.before) / width;
    Real low = 0, high = 1, x = wanted / coefficient[0];
    constexpr int kMostSteps = 100;
    for (int step = 0; step < kMostSteps; ++step) {
      if (!(x > low && x < high)) x = (low + high) / 2;
      const Real z = 2 * x - 1;
      Real p = 1, before = 0, integral = 0, value = 0;  // int_0^x P_k(2y - 1) dy = (P_{k+1} - P_{k-1})/(2 (2k + 1)); x for k = 0
      for (std::size_t k = 0; k < count; ++k) {
        const auto n = static_cast<Real>(k);
        const Real next = ((2 * n + 1) * z * p - n * before) / (n + 1);
        integral += coefficient[k] * (k == 0 ? x : (next - before) / (2 * (2 * n + 1)));
        value += coefficient[k] * p;
        before = p;
        p = next;
      }
      (integral < wanted ? low : high) = x;
      const Real change = (wanted - integral) / value;
      if (!(high - low > std::numeric_limits<Real>::epsilon()) || std::abs(change) < 1e-15) break;
      x += change;
    }
    return a + std::clamp<Real>(x, 0, 1) * width;
  }
};

}  // namespace nullmark
