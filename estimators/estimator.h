#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimators/theory/ray_profile.h"
#include "estimators/theory/theory.h"
#include "estimators/walk/event.h"
#include "estimators/walk/medium_ray.h"
#include "estimators/walk/quantity.h"
#include "media/base/matter_bounds.h"
#include "media/base/parameters.h"

namespace nullmark {

// An estimator is a class template over Value (media/base/value.h): Real on grey media, a SpectrumOf some width on chromatic
// ones, Lanes where walks run side by side.  Its parameters are fields.  RayData is the estimator's own type of that name, or
// MediumRay<Value>.  harness/kernel/estimator_traits.h rejects members of these names with other signatures.  Required:
//
//   static constexpr kName, kSummary, kSource
//       the name in configurations, a one-line summary, paper and equation
//   static constexpr SampleRange kRange
//   static constexpr bool kNeedsBound
//       false if it stays unbiased at any positive rate
//   Guarantee claim(Quantity) const
//   struct Walk
//       the state of one sample
//   void init(Walk&, const RayData&, Flight&, auto& rng) const
//   bool propose(Walk&, const RayData&, Flight&, auto& rng) const
//       true: "look up the extinction at flight.position()"; flight.lookups() is the number of lookups before it
//   void consume(Walk&, const RayData&, const Flight&, const Value& extinction, auto& rng) const
//   Value result(const Walk&, const RayData&) const
//       the transmittance estimate
//
// Optional:
//
//   void parameters(ParameterVisitor&)
//   void check(const MatterBounds& medium) const
//       throws ParameterError: parameters do not fit the medium
//   SampleRange range() const
//       if the range depends on the parameters
//   Real order(Quantity) const
//       for consistent estimators: |bias| ~ h^order
//   struct RayData : MediumRay<Value>; void prepare(RayData&) const
//       the estimator's own data for each ray
//   Value optical_depth(const Walk&, const RayData&) const
//       answers Quantity::optical_depth as well
//   Event<Value> event(const Walk&, const RayData&, const Flight& at) const
//       how the flight ended at its current position: answers Quantity::free_path, and light paths use it
//   bool samples_events(int channels) const
//       false if there is no event for this many channels; default true
//   Theory weight_theory(const RayData&, const RayProfile&, int channel) const
//       of the event's weight and the lookups of the flight
//   Value transmittance_at(const Walk&, const RayData&, Real distance) const
//       estimate of T(begin, distance) by a walk that has met no collision since `distance`: answers
//       Quantity::transmittance_profile
//   Value expected(const Value& tau, const RayData&) const
//       a target other than exp(-tau), e.g. a factor of T
//   bool flies_once(int channels) const
//       false if a sample takes several flights, or collides without a lookup; its walks are then not in lanes; default true
//   int real_collisions(const Walk&, const RayData&) const
//       tentative collisions that ended a walk; default 0
//   Theory theory(const RayData&, const RayProfile&, int channel, Quantity) const
//   CountLaw count_law(const RayData&, const RayProfile&, int channel) const
//       of a product of independent weights
//   bool needs_optical_depth() const
//       if kNeedsOpticalDepth depends on the parameters
//   int component(const Walk&) const
//       with kNeedsShares: the one component i of a sum that is looked up at a collision; `extinction` is then mu_i over its
//       share, whose mean over the shares is mu
//   static constexpr bool kIgnoresMajorant
//       lookups are not tentative collisions: they are not checked against the majorant
//   static constexpr bool kHeavySamples
//       the fourth moment can be infinite although the variance is finite; no number of samples shows this
//   static constexpr bool kHeavyLookups
//       the number of lookups has infinite variance at the defaults, so its mean over samples does not settle
//   static constexpr bool kGreyOnly
//       takes media of one channel; no kernel of several is compiled
//   static constexpr bool kOwnFlights
//       lookups are no tentative collisions at the ray's majorant: flights start on other rates, or use other draws.  The harness
//       predicts no lookups from the majorant and draws no exponentials ahead
//   static constexpr bool kDrawsExponentials
//       with kOwnFlights: most steps draw an exponential first, so the loop takes the logarithms of a block together
//   static constexpr bool kLanes = true
//       walks run side by side in registers, in double and in float, of 3 and 4 channels in double: Walk holds one to six Value,
//       Distance<Value>, Truth<Value> or structs of them, whose numbers stay as they are once a walk has ended;
//       init, propose, consume and result take ray, flight and stream as auto, and branch by select() and flight.next(rng, alive)
//       where walks can differ (see lane_kernel.h).  flight.lookups() cannot differ
//   using Kept
//       with kLanes: what one sample keeps beside registers, over OneSample<Value>; unbiased_ray_marching.h is an example.  Walk
//       is std::conditional_t<kSideBySide<Value>, InLane, Kept>: Kept itself in the plain loop, a struct of registers in lanes;
//       init, propose and consume have an overload for each, and both draw the same numbers in the same order.  The number of
//       samples of a block in lanes, a multiple of 16, is Kept::kTogether.  In lanes each begins with begin(kept, ray).  After
//       each consume, keep(walk, ray, at, alive, kept) stores what the walks have come to, for each lane k of the mask `alive` in
//       kept(k); numbers(x) are the lanes of x, and as_bits(mask) has lane k as bit k.  A walk without a lookup is never kept. At
//       a walk's end lanes call finish(kept, ray) and result(kept, ray); the plain loop calls init, which may begin likewise, and
//       result alone
//   bool completes(const auto& ray, std::uint32_t lookups) const
//       with kLanes: whether the consume that sees at.lookups() == lookups changes `complete`, the last member of Walk.  At other
//       lookups lanes leave it in memory and lose a change.  This pays where walks hold many numbers, as in jackknife.h
//   static constexpr bool kNeedsOpticalDepth, kNeedsKnots, kNeedsInversion, kNeedsShares
//       the harness fills exact_depth, knots, distance_at_depth, shares
//
// A derived estimator removes an inherited member by a constant of its name: static constexpr bool count_law = false.
//
// The harness runs the loop, counts lookups, checks the majorant and provides the random streams.

}  // namespace nullmark
