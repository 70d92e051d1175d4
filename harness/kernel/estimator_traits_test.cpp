// What a tracker has is found by name and by signature; a slip in a signature is an error and not a silence.

#include "harness/kernel/estimator_traits.h"

#include <gtest/gtest.h>

#include "estimators/delta.h"
#include "estimators/jackknife.h"
#include "estimators/ratio.h"
#include "estimators/residual_ratio.h"

namespace nullmark {
namespace {

using Delta = DeltaTracking<Real>;

/// Once compiled and was never called.
struct EventWithoutFlight : Delta {
  Event<Real> event(const Walk&, const RayData&) const { return {}; }
};
struct EventTemplateWithoutFlight : Delta {
  auto event(const Walk&, const auto&) const { return Event<Real>{}; }
};
struct TheoryWithoutQuantity : Delta {
  Theory theory(const RayData&, const RayProfile&, int) const { return {}; }
};
struct OrderOfNothing : Delta {
  Real order() const { return 1; }
};
struct CheckOfARay : Delta {
  void check(const RayData&) const {}
};

template <class E>
using Traits = EstimatorTraits<E, Real>;

TEST(EstimatorTraits, ASlipInASignatureIsSeenByItsName) {
  EXPECT_TRUE(Traits<Delta>::kEvent && Traits<Delta>::kTheory);
  EXPECT_TRUE(detail::names_event<EventWithoutFlight> && !Traits<EventWithoutFlight>::kEvent);
  EXPECT_TRUE(detail::names_event<EventTemplateWithoutFlight> && !Traits<EventTemplateWithoutFlight>::kEvent);
  EXPECT_TRUE(detail::names_theory<TheoryWithoutQuantity> && !Traits<TheoryWithoutQuantity>::kTheory);
  EXPECT_TRUE(detail::names_order<OrderOfNothing> && !Traits<OrderOfNothing>::kOrder);
  EXPECT_TRUE(detail::names_check<CheckOfARay> && !Traits<CheckOfARay>::kCheck);
}

TEST(EstimatorTraits, WhatIsNotThereIsNotNamed) {
  EXPECT_FALSE(detail::names_event<RatioTracking<Real>> || detail::names_order<RatioTracking<Real>>);
  EXPECT_FALSE(detail::names_component<RatioTracking<Real>>);
}

TEST(EstimatorTraits, AParameterMayHaveTheNameOfAFunction) {
  struct WithParameters : RatioTracking<Real> {
    std::string component = "both";
    int order = 2;
  };
  EXPECT_FALSE(detail::names_component<WithParameters> || detail::names_order<WithParameters>);
  EXPECT_TRUE((expect_estimator<WithParameters, Real>()));
}

TEST(EstimatorTraits, ControlsAndInversionsAskForTheDepth) {
  ResidualRatioTracking<Real> tracker;
  EXPECT_FALSE(Traits<ResidualRatioTracking<Real>>::needs_optical_depth(tracker));
  tracker.choice.kind = "ray_average";
  EXPECT_TRUE(Traits<ResidualRatioTracking<Real>>::needs_optical_depth(tracker));
}

}  // namespace
}  // namespace nullmark
