#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "estimators/estimator.h"
#include "estimators/theory/debiased_theory.h"

namespace nullmark {

/// The marches of one sample of unbiased ray marching.
template <class Value>
struct Marches {
  static constexpr std::size_t kTogether = 256;  ///< walks of a block, most of which end after one march
  static constexpr int kMostOrder = 32;          ///< P_32 = 8e-28
  std::array<Value, kMostOrder + 1> march;       ///< X = -h sum mu, of those that are complete
  Value sum, trend;                              ///< of the march at hand; mu(d) - mu(0)
  Real offset = 0;
  std::uint32_t before = 0;  ///< lookups before that march
  int order = 0, complete = 0;
};

/// Unbiased ray marching [Kettunen, d'Eon, Pantaleoni, Novák 2021].  A march of M steps with one offset o, X = -h sum_j mu((o +
/// j) h), estimates -tau; e^{-tau} = e^p E[sum_k (X - p)^k/k!] is expanded about a pivot p that is itself such a march.  n + 1
/// marches are drawn, each is the pivot in turn, and the powers are elementary symmetric means m_k of the other n less the pivot:
///
///   T = 1/(n+1) sum_j e^{X_j} sum_{k<=n} m_k/(k! P_k),   P_k = P(n >= k): 1, .1, .1, then P_{k-1} 2/k.
///
/// P_k k! = 2^k/20 for k >= 1.  M from the control optical thickness t_c (the majorant's, or that less the minorant's) over the
/// ray, M = max(1, floor(N/1.3194528 + 1/2)), N = ceil(cbrt((.015 + t_c)(.65 + t_c)(60.3 + t_c))): tight local bounds shorten the
/// comb, which is equidistant in length all the same.  Endpoint matching looks up both ends and takes h (1/2 - o)(mu(d) - mu(0)),
/// of mean 0, from X: affine extinction leaves no variance then, constant extinction in any case.  Unbiased for any t_c; signed
/// and unbounded.  Of several channels one comb and one n.  Lookups M (1 + E n), E n = (e^2 - 1)/20, and 2 for the ends.
template <class Value>
struct UnbiasedRayMarching {
  static constexpr const char* kName = "unbiased_ray_marching";
  static constexpr const char* kSummary =
      "unbiased ray marching: power series about marches, by symmetric means of further marches";
  static constexpr const char* kSource = "Kettunen, d'Eon, Pantaleoni, Novak 2021, Alg. 1";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kLanes = true;

  using Kept = Marches<OneSample<Value>>;
  static constexpr int kMostOrder = Kept::kMostOrder;
  static constexpr Real kMeanOrder = 0.31945280494653251;     ///< sum_k P_k = (e^2 - 1)/20
  static constexpr Real kOrderVariance = 1.0563083202513903;  ///< (3 e^2 + 1)/20 - that squared

  bool endpoint_matching = false;
  std::string control = "majorant";

  void parameters(ParameterVisitor& visit) {
    visit.flag("endpoint_matching", endpoint_matching,
               "look up both ends of the ray and remove the linear trend from each march");
    visit.choice("control", control, {"majorant", "majorant_minorant"},
                 "optical thickness that sets the length of a march: of the majorant, or of majorant minus minorant");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Real steps = 0, step = 0;   ///< M and h; M = 0 where there is nothing to look up
    std::uint32_t lookups = 0;  ///< M, where a walk may take as many
  };

  void prepare(RayData& ray) const {
    Real thickness = ray.majorant.total_depth();
    ray.steps = ray.step = 0;
    if (!(thickness > 0)) return;
    if (control == "majorant_minorant")
      for (const Segment& segment : ray.bounds.segments())
        thickness -= segment.extinction.minimum.minCoeff() * (segment.end - segment.begin);
    thickness = std::max<Real>(0, thickness);
    const Real lookups = std::ceil(std::cbrt((.015 + thickness) * (.65 + thickness) * (60.3 + thickness)));
    ray.steps = std::max<Real>(1, std::floor(lookups / (1 + kMeanOrder) + .5));
    ray.step = ray.length() / ray.steps;
    ray.lookups = static_cast<std::uint32_t>(std::min<Real>(ray.steps, std::numeric_limits<std::uint32_t>::max()));
  }

  /// In lanes a walk holds the march at hand, and the kernel has the marches of each sample beside; all walks of a block are at
  /// the same step of a march.
  struct March {
    Value sum, trend;
    Distance<Value> offset, left;  ///< left: further marches
  };
  using Walk = std::conditional_t<kSideBySide<Value>, March, Kept>;

  void begin(Kept& walk, const auto& ray) const {
    walk.sum = walk.trend = ray.value(0);
    walk.before = ends();
    walk.order = walk.complete = 0;
  }

  void init(Kept& walk, const auto& ray, auto&, auto& rng) const {
    begin(walk, ray);
    if (rng.uniform() < .1)
      for (walk.order = 2; walk.order < kMostOrder && rng.uniform() * (walk.order + 1) < 2;) ++walk.order;
  }

  bool propose(Kept& walk, const auto& ray, auto& flight, auto& rng) const {
    if (!(ray.steps > 0) || walk.complete > walk.order) return false;
    if (at_ends(flight.lookups())) {
      flight.jump(flight.lookups() == 0 ? ray.begin : ray.end);
      return true;
    }
    const std::uint32_t done = flight.lookups() - walk.before;
    if (done == 0) walk.offset = rng.uniform();
    flight.jump(ray.begin + (walk.offset + done) * ray.step);
    return true;
  }

  void consume(Kept& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    if (at_ends(at.lookups() - 1)) {
      walk.trend = extinction - walk.trend;
      return;
    }
    walk.sum += extinction;
    if (at.lookups() - walk.before < ray.lookups) return;
    add_march(walk, ray, walk.sum, walk.trend, walk.offset);
    walk.sum = ray.value(0);
    walk.before = at.lookups();
  }

  void init(March& walk, const auto&, auto&, auto& rng) const {
    walk = {Value(0), Value(0), Distance<Value>(0), Distance<Value>(0)};
    auto longer = rng.uniform() < Distance<Value>(.1);
    walk.left = select(longer, Distance<Value>(2), walk.left);
    for (int order = 2; order < kMostOrder && !none(longer); ++order) {
      longer = longer & (rng.uniform_where(longer) * Distance<Value>(order + 1) < Distance<Value>(2));
      walk.left = select(longer, Distance<Value>(order + 1), walk.left);
    }
  }

  auto propose(March& walk, const auto& ray, auto& flight, auto& rng) const {
    const std::uint32_t lookups = flight.lookups();
    if (at_ends(lookups)) {
      flight.jump(Distance<Value>(lookups == 0 ? ray.begin : ray.end));
      return (Distance<Value>(ray.steps) > Distance<Value>(0)) & !(walk.left < Distance<Value>(0));
    }
    const std::uint32_t done = steps_done(ray, lookups);
    if (done == 0 && lookups > ends()) {
      walk.left = walk.left - Distance<Value>(1);
      walk.sum = Value(0);
    }
    const auto goes_on = (Distance<Value>(ray.steps) > Distance<Value>(0)) & !(walk.left < Distance<Value>(0));
    if (done == 0) walk.offset = rng.uniform(goes_on);
    flight.jump(Distance<Value>(ray.begin) + (walk.offset + Distance<Value>(done)) * Distance<Value>(ray.step));
    return goes_on;
  }

  void consume(March& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    if (at_ends(at.lookups() - 1))
      walk.trend = extinction - walk.trend;
    else
      walk.sum += extinction;
  }

  /// Hands marches in lanes that are complete over to `kept(lane)`.
  void keep(const March& walk, const auto& ray, const auto& at, auto alive, const auto& kept) const {
    if (at.lookups() <= ends() || steps_done(ray, at.lookups()) != 0) return;
    const auto sum = numbers(walk.sum), trend = numbers(walk.trend);
    const auto offset = numbers(walk.offset);
    const std::uint64_t lives = as_bits(alive);
    for (std::size_t k = 0; k < offset.size(); ++k)
      if ((lives >> k & 1) != 0) add_march(kept(k), ray, sum[k], trend[k], offset[k]);
  }

  /// Ends a walk in lanes.
  void finish(Kept& walk, const auto&) const { walk.order = walk.complete - 1; }

  OneSample<Value> result(const Kept& walk, const auto& ray) const {
    if (!(ray.steps > 0)) return ray.value(1);
    // So long a series comes up once in 10^27 samples; cut short it would be wrong, so that it counts as an error.
    if (walk.order == kMostOrder) return ray.value(std::numeric_limits<Real>::quiet_NaN());
    return series(walk, ray);
  }

  /// The variance is that of the series over the comb's own law.  Nothing where that takes too many lookups, or orders.
  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.steps > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Real ends = endpoint_matching ? 2 : 0;
    return {.variance = unbiased_march_variance(profile, c, ray.steps, endpoint_matching),
            .lookups = ray.steps * (1 + kMeanOrder) + ends,
            .lookups_variance = ray.steps * ray.steps * kOrderVariance};
  }

 private:
  using One = OneSample<Value>;

  std::uint32_t ends() const { return endpoint_matching ? 2 : 0; }
  /// Whether the next lookup is of an end of the ray.
  bool at_ends(std::uint32_t lookups) const { return lookups < ends(); }
  /// Of the march at hand, of walks that have all marched since the ends.
  std::uint32_t steps_done(const auto& ray, std::uint32_t lookups) const {
    return ray.lookups > 0 ? (lookups - ends()) % ray.lookups : 0;
  }

  static void add_march(Kept& walk, const auto& ray, const One& sum, const One& trend, Real offset) {
    walk.march[static_cast<std::size_t>(walk.complete++)] = (trend * (offset - .5) - sum) * ray.step;
  }

  static One series(const Kept& walk, const auto& ray) {
    const auto n = static_cast<std::size_t>(walk.order);
    One sum = ray.value(0);
    for (std::size_t pivot = 0; pivot <= n; ++pivot) {
      const One scale = exponential(walk.march[pivot]);
      if (vanished(scale)) continue;
      std::array<One, kMostOrder + 1> mean;
      std::fill_n(mean.begin(), n + 1, ray.value(0));
      mean[0] = ray.value(1);
      std::size_t q = 0;
      for (std::size_t i = 0; i <= n; ++i) {
        if (i == pivot) continue;
        ++q;
        for (std::size_t k = q; k > 0; --k)
          mean[k] += static_cast<Real>(k) / static_cast<Real>(q) * (mean[k - 1] * (walk.march[i] - walk.march[pivot]) - mean[k]);
      }
      One terms = ray.value(1);
      Real twentieth = .05;  // k! P_k
      for (std::size_t k = 1; k <= n; ++k) terms += mean[k] / (twentieth *= 2);
      sum += select(scale > 0, scale * terms, ray.value(0));
    }
    return sum / static_cast<Real>(n + 1);
  }
};

}  // namespace nullmark
