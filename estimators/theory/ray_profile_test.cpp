#include "estimators/theory/ray_profile.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nullmark {
namespace {

const RayProfile::Lookup kTwoChannels = [](const Real* t, std::size_t count, Real* out) {
  for (std::size_t i = 0; i < count; ++i) {
    out[2 * i] = std::exp(-t[i]);
    out[2 * i + 1] = t[i] < 1.5 ? 2 : 1;
  }
};

TEST(RayProfile, IntegratesAndAccumulatesPerChannel) {
  const std::vector<Real> cuts{1, 1.5, 3}, ends{2, 3}, rates{1, 30};
  const RayProfile profile(kTwoChannels, 2, cuts, ends, rates);
  EXPECT_TRUE(profile.resolved());
  EXPECT_NEAR(profile.optical_depth(0), std::exp(-1.) - std::exp(-3.), 1e-14);
  EXPECT_NEAR(profile.optical_depth(1), 1 + 1.5, 1e-13);
  for (const RayProfile::Node& node : profile.nodes(0)) {
    EXPECT_NEAR(node.depth, std::exp(-1.) - std::exp(-node.t), 1e-13);
    EXPECT_EQ(node.piece, node.t < 2 ? 0u : 1u);
  }
  for (const RayProfile::Node& node : profile.nodes(1))
    EXPECT_NEAR(node.depth, node.t < 1.5 ? 2 * (node.t - 1) : 1 + node.t - 1.5, 1e-13);
  // A boundary layer e^{-30 (3 - t)} is resolved because the panels follow the majorant depth.
  EXPECT_NEAR(profile.integrate(0, [](const RayProfile::Node& node) { return node.t > 2 ? std::exp(-30 * (3 - node.t)) : 0; }),
              -std::expm1(-30.) / 30, 1e-12);
}

TEST(RayProfile, SaysWhenItsPanelsDoNotSuffice) {
  const std::vector<Real> cuts{0, 1}, ends{1}, rates{1e6};
  EXPECT_FALSE(RayProfile(kTwoChannels, 2, cuts, ends, rates).resolved());
}

TEST(RayProfile, AnEmptyRayHasNoDepth) {
  const std::vector<Real> cuts{0};
  const RayProfile profile(kTwoChannels, 2, cuts, {}, {});
  EXPECT_EQ(profile.optical_depth(0), 0);
  EXPECT_EQ(profile.integrate(0, [](const RayProfile::Node&) { return 1.; }), 0);
}

}  // namespace
}  // namespace nullmark
