// What a tracker has is found by name and by signature; a slip in a signature is an error and not a silence.

#include "harness/kernel/estimator_traits.h"

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>

#include "estimators/delta.h"
#include "estimators/jackknife.h"
#include "estimators/ratio.h"
#include "estimators/residual_ratio.h"
#include "harness/io/file_io.h"
#include "harness/registry/register_estimator.h"

namespace nullmark {

/// Ratio tracking without its `transmittance_at`, and with a slip.
template <class Value>
struct Misspelt : RatioTracking<Value> {
  static constexpr bool transmittance_at = false;
  Value transmitance_at(const typename RatioTracking<Value>::Walk& walk, const MediumRay<Value>&, Real) const {
    return walk.weight;
  }
};

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
struct CompletesByWalk : Jackknife<Real> {
  bool completes(const Walk&) const { return true; }
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
  EXPECT_TRUE(detail::names_completes<CompletesByWalk> && !Traits<CompletesByWalk>::kCompletes);
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

TEST(EstimatorTraits, AMisspeltMemberIsListedAsNotStated) {
  const auto members_of = [](const EstimatorEntry& entry) {
    return std::map<std::string, bool>(entry.members.begin(), entry.members.end());
  };
  const auto right = members_of(estimator_entry<RatioTracking>()), wrong = members_of(estimator_entry<Misspelt>());
  EXPECT_TRUE(right.at("transmittance_at") && right.at("theory") && right.at("kLanes"));
  EXPECT_FALSE(wrong.at("transmittance_at"));
  EXPECT_TRUE(wrong.at("theory"));
  EXPECT_FALSE(right.at("event") || right.at("kNeedsShares"));
}

TEST(EstimatorTraits, EveryOptionalMemberIsListed) {
  std::set<std::string> listed;
  for (const auto& [member, has] : estimator_entry<RatioTracking>().members) listed.insert(member);
  const std::string traits = read_file(NULLMARK_SOURCE_DIR "/harness/kernel/estimator_traits.h");
  const std::string interface = read_file(NULLMARK_SOURCE_DIR "/estimators/estimator.h");
  const std::string optional = interface.substr(interface.find("// Optional:"));
  std::size_t found = 0;
  for (const auto& [text, pattern] :
       {std::pair(&traits, "\nNULLMARK_NAMES\\((\\w+)\\)"), std::pair(&optional, "\\b(k[A-Z]\\w+)[,\n ]"),
        std::pair(&optional, "// +using (\\w+)\n")}) {
    const std::regex regex(pattern);
    for (std::sregex_iterator at(text->begin(), text->end(), regex), end; at != end; ++at, ++found)
      EXPECT_TRUE(listed.contains((*at)[1])) << (*at)[1];
  }
  EXPECT_GT(found, 24u);
}

TEST(EstimatorTraits, ControlsAndInversionsAskForTheDepth) {
  ResidualRatioTracking<Real> tracker;
  EXPECT_FALSE(Traits<ResidualRatioTracking<Real>>::needs_optical_depth(tracker));
  tracker.choice.kind = "ray_average";
  EXPECT_TRUE(Traits<ResidualRatioTracking<Real>>::needs_optical_depth(tracker));
}

}  // namespace
}  // namespace nullmark
