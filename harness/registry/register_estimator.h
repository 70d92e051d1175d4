#pragma once

#include <memory>

#include "harness/kernel/estimator_template.h"
#include "harness/registry/estimator_entry.h"

namespace nullmark {

/// EstimatorEntry::members.
template <class E>
std::vector<std::pair<const char*, bool>> optional_members() {
  using Traits = EstimatorTraits<E, Real>;
  constexpr bool data = requires { typename E::RayData; }, lanes = requires { requires E::kLanes; };
  constexpr bool kept = requires { typename E::Kept; };
  constexpr bool samples = requires { E::kHeavySamples; }, lookups = requires { E::kHeavyLookups; };
  constexpr bool depth = requires { E::kNeedsOpticalDepth; };
  return {{"theory", Traits::kTheory},
          {"count_law", Traits::kCountLaw},
          {"event", Traits::kEvent},
          {"weight_theory", Traits::kWeightTheory},
          {"samples_events", Traits::kSamplesEvents},
          {"optical_depth", Traits::kOpticalDepth},
          {"transmittance_at", Traits::kTransmittanceAt},
          {"expected", Traits::kExpected},
          {"parameters", Traits::kParameters},
          {"check", Traits::kCheck},
          {"range", Traits::kRangeByParameters},
          {"order", Traits::kOrder},
          {"RayData", data},
          {"prepare", Traits::kPrepare},
          {"flies_once", Traits::kFliesOnce},
          {"real_collisions", Traits::kRealCollisions},
          {"component", Traits::kComponent},
          {"needs_optical_depth", Traits::kMayNeedOpticalDepth},
          {"kLanes", lanes},
          {"Kept", kept},
          {"completes", Traits::kCompletes},
          {"kGreyOnly", Traits::kGreyOnly},
          {"kIgnoresMajorant", Traits::kIgnoresMajorant},
          {"kHeavySamples", samples},
          {"kHeavyLookups", lookups},
          {"kOwnFlights", Traits::kOwnFlights},
          {"kDrawsExponentials", Traits::kDrawsExponentials},
          {"kNeedsOpticalDepth", depth},
          {"kNeedsKnots", Traits::kNeedsKnots},
          {"kNeedsInversion", Traits::kNeedsInversion},
          {"kNeedsShares", Traits::kNeedsShares}};
}

template <template <class> class Estimator>
EstimatorEntry estimator_entry() {
  using E = Estimator<Real>;
  EstimatorEntry entry;
  entry.name = E::kName;
  entry.summary = E::kSummary;
  entry.source = E::kSource;
  entry.range = Estimator<Spectrum>::kRange;
  entry.needs_bound = E::kNeedsBound;
  entry.in_lanes = runs_in_lanes<Estimator>();
  entry.members = optional_members<E>();
  entry.ignores_majorant = requires { E::kIgnoresMajorant; };
  entry.heavy_samples = requires { E::kHeavySamples; };
  entry.heavy_lookups = requires { E::kHeavyLookups; };
  const auto kernel = EstimatorTemplate<Estimator>().kernel(1);
  for (std::size_t i = 0; i < kQuantities; ++i)
    if (kernel->answers(static_cast<Quantity>(i))) entry.quantities.push_back(static_cast<Quantity>(i));
  entry.quantities.push_back(Quantity::radiance);  // where nothing scatters or emits, any transmittance carries light
  entry.make = []() -> std::unique_ptr<EstimatorSource> { return std::make_unique<EstimatorTemplate<Estimator>>(); };
  return entry;
}

/// Whether an estimator with kLanes meets the requirements of lanes.
template <template <class> class Estimator>
consteval bool has_the_lanes_it_claims() {
  if constexpr (requires { requires Estimator<Real>::kLanes; }) return runs_in_lanes<Estimator>();
  return true;
}

/// `Bug` has kCaughtBy: "mean", "count_law", "replay", "lookups", "variance", "independence", "audit", "nonfinite", "groups",
/// "position_law", "chi_square", "reliance" (CellRecord::reliance says so) or "open" (an INCONCLUSIVE that was not planned).
template <template <class> class Bug, class Source = EstimatorTemplate<Bug>>
EstimatorEntry planted_entry() {
  EstimatorEntry entry = estimator_entry<Bug>();
  entry.make = []() -> std::unique_ptr<EstimatorSource> { return std::make_unique<Source>(); };
  entry.planted = true;
  entry.caught_by = Bug<Real>::kCaughtBy;
  return entry;
}

}  // namespace nullmark

/// Registers an estimator for all commands and contract tests.  In the repository the build generates this line from
/// `nullmark_estimator(header Class)`; a plug-in writes it itself.
#define NULLMARK_REGISTER_ESTIMATOR(Estimator)                                                                      \
  static_assert(::nullmark::has_the_lanes_it_claims<Estimator>(),                                                   \
                "a tracker with kLanes takes ray, flight and stream of init, propose, consume and result as auto"); \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_estimator_, __COUNTER__) =                       \
      ::nullmark::Registry<::nullmark::EstimatorEntry>::instance().add(::nullmark::estimator_entry<Estimator>())

/// The same for a planted bug; `__VA_ARGS__` is its template and, if that is not EstimatorTemplate, its source.
#define NULLMARK_REGISTER_PLANTED_BUG(...)                                                  \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_planted_, __COUNTER__) = \
      ::nullmark::Registry<::nullmark::EstimatorEntry>::instance().add(::nullmark::planted_entry<__VA_ARGS__>())
