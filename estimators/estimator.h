#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimators/theory/ray_profile.h"
#include "estimators/walk/event.h"
#include "estimators/walk/flight.h"
#include "media/base/parameters.h"
#include "media/base/value.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// What an estimator says of its mean.  `exact`: no variance, error of rounding only.  `unbiased`: mean T (or tau) for any sample
/// count. `consistent`: bias vanishes with the step.  `biased`: neither; registered for comparison.
enum class Claim { exact, unbiased, consistent, biased };

/// Values one sample can take, when the majorant bounds the extinction.
enum class SampleRange { binary, unit, non_negative, any_sign };

/// What is estimated: T = exp(-tau); tau; T at several distances of one walk; how a free flight ends; the radiance that arrives
/// along a ray, with the flights that `event` tells of.
enum class Quantity { transmittance, optical_depth, transmittance_profile, free_path, radiance };
inline constexpr std::size_t kQuantities = 5;

/// Numbers that walks are made of.  Single precision: flights, lookups and weights in float, so a flight is told to 2^-24 of the
/// majorant depth of its ray; means over samples are taken in double.
enum class Precision { float64, float32 };

/// Distance from 1 to the next number.
constexpr Real epsilon_of(Precision precision) {
  return precision == Precision::float64 ? std::numeric_limits<Real>::epsilon() : Real{std::numeric_limits<float>::epsilon()};
}

/// Exact moments of one sample, where known; lookups are their expectation.
struct Theory {
  std::optional<Real> mean{};  ///< left out: the quantity itself
  std::optional<Real> variance{};
  std::optional<Real> lookups{};
  std::optional<Real> lookups_variance{};  ///< of one sample
};

/// Moments of a product estimator given its number K of collisions: with rate m, weights w(x) and collision depth M = int m,
/// E[X | K = k] = factor (int m w / M)^k and E[X^2 | K = k] = factor^2 (int m w^2 / M)^k; K is Poisson of mean M.
struct CountLaw {
  Real depth = 0;  ///< M
  Real factor = 1;
  Real first = 0;   ///< int m w / M
  Real second = 0;  ///< int m w^2 / M
};

/// One ray's way through the medium, as all walks of a block share it.
template <class Value>
struct Passage {
  Real begin = 0, end = 0;  ///< world lengths
  int channels = 1;
  Rates majorant;                    ///< one piece per segment, the majorant of the largest channel
  SegmentBuffer bounds;              ///< extrema per segment
  Extrema medium;                    ///< over the whole medium
  std::optional<Value> exact_depth;  ///< tau in closed form or by exact traversal; only for estimators with kNeedsOpticalDepth
  std::vector<Real> knots;           ///< sorted, begin and end included; only for estimators with kNeedsKnots
  std::optional<int> degree;         ///< of the extinction between knots
  Vec3 entry = Vec3::Zero();         ///< world point at `begin`
  Value albedo;                      ///< mu_s / mu, in [0, 1]; 0 where nothing scatters
  std::function<Real(Real)>
      distance_at_depth;         ///< of grey media with closed-form depth; only for estimators with kNeedsInversion
  Value throughput;              ///< of the path before this flight, 1 where it begins; for trackers that heed the past
  std::vector<Spectrum> shares;  ///< per segment: bounds of a sum's components over their sum; only with kNeedsShares
  bool draws_absorption = true;  ///< false: absorption is left to weights (E[w; collision] = mu_s T dt), since nothing emits

  Real length() const { return end - begin; }
  Value value(Real x) const { return uniform_value<Value>(channels, x); }
};

// An estimator is a class template over Value with its parameters as fields and
//
//   static constexpr kName, kSummary, kSource     config name, one line, paper and equation
//   static constexpr SampleRange kRange
//   static constexpr bool kNeedsBound             false where any positive rate leaves it unbiased
//   Claim claim(Quantity) const
//   struct Walk                                   the state of one sample
//   void init(Walk&, const Ray&, Flight&, auto& rng) const
//   bool propose(Walk&, const Ray&, Flight&, auto& rng) const      true: "look up the extinction at flight.position()"
//   void consume(Walk&, const Ray&, const Flight&, const Value& extinction, auto& rng) const
//   Value result(const Walk&, const Ray&) const   the transmittance estimate
//
// and where it has them
//
//   void parameters(ParameterVisitor&)
//   void check(const Extrema& medium) const                 throws ParameterError: parameters do not fit the medium
//   SampleRange range() const                               where the range depends on the parameters
//   Real order(Quantity) const                              of a consistent estimator: |bias| ~ h^order
//   using Ray = ...; void prepare(Ray&) const               per-ray data of its own, derived from Passage<Value>
//   Value optical_depth(const Walk&, const Ray&) const      answers Quantity::optical_depth as well
//   Event<Value> event(const Walk&, const Ray&, const Flight& at) const
//                                                           how the flight, which stands where it ended, did so: answers
//                                                           Quantity::free_path, drives paths
//   bool samples_events(int channels) const                 false where there is no event for so many channels; default true
//   Theory weight_theory(const Ray&, const RayProfile&, int channel) const
//                                                           of the event's weight and the lookups of the flight
//   Value transmittance_at(const Walk&, const Ray&, Real distance) const
//                                                           estimate of T(begin, distance) by a walk that has met no collision
//                                                           since `distance`: answers Quantity::transmittance_profile
//   Value expected(const Value& tau, const Ray&) const      a target other than exp(-tau), e.g. a factor of T
//   bool flies_once(int channels) const                     false where a sample is several flights or collides without a
//                                                           lookup; default true
//   int real_collisions(const Walk&, const Ray&) const      tentative collisions that ended a walk; default 0
//   Theory theory(const Ray&, const RayProfile&, int channel, Quantity) const
//   CountLaw count_law(const Ray&, const RayProfile&, int channel) const
//                                                           of a product of independent weights
//   static constexpr bool kIgnoresMajorant                  lookups are no tentative collisions: not audited
//   static constexpr bool kHeavySamples                     their fourth moment can be infinite while their variance is not, so
//                                                           that no number of them shows it
//   static constexpr bool kHeavyLookups                     their number has no variance at the defaults, so that its mean over
//                                                           samples does not settle
//   static constexpr bool kOwnFlights                       draws its flights by a law of its own
//   static constexpr bool kLanes = true                     walks run side by side in registers, in double and in float: Walk
//                                                           holds nothing but Value, Distance<Value> and Truth<Value>; init,
//                                                           propose, consume and result take ray, flight and stream as auto
//                                                           and decide by select() and flight.next(rng, alive) where walks
//                                                           may differ (see lane_kernel.h)
//   static constexpr bool kNeedsOpticalDepth, kNeedsKnots, kNeedsInversion, kNeedsShares
//                                                           asks the harness to fill exact_depth, knots, distance_at_depth,
//                                                           shares
//   int component(const Walk&) const                        with kNeedsShares: the one component i of a sum that is looked up at
//                                                           a collision; `extinction` is then mu_i over its share, whose mean
//                                                           over the shares is mu
//
// The loop, the counting, the majorant audit and the random streams are the harness's.

}  // namespace nullmark
