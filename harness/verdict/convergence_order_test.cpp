// Which orders of convergence are measured, refuted or not resolved.

#include "harness/verdict/convergence_order.h"

#include <gtest/gtest.h>

#include <cmath>

#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

/// Cells of a march with the given error of the optical depth at every step count.
std::vector<CellRecord> marches(const std::vector<std::pair<int, Real>>& biases, Real claimed, Real variance = 0) {
  std::vector<CellRecord> cells;
  for (const auto& [steps, bias] : biases) {
    CellRecord record = example_results().cells[0];
    record.cell.estimator = Component{"ray_marching", {{"steps", steps}, {"offset", std::string("left")}}, "", ""};
    record.claims = "consistent";
    record.order = claimed;
    record.samples = 1'000'000;
    ChannelRecord& channel = record.channel.at(0);
    channel.reference = 0.5;
    channel.reference_error = 1e-12;
    channel.bias = 0.5 * std::expm1(bias);
    channel.variance_theory = variance;
    cells.push_back(record);
  }
  return cells;
}

std::vector<std::pair<int, Real>> power(Real order, Real first, Real ripple = 0) {
  std::vector<std::pair<int, Real>> biases;
  for (const int steps : {8, 16, 32, 64})
    biases.emplace_back(steps, first * std::pow(8. / steps, order) * (1 + ripple * (steps == 16 ? -1 : 1)));
  return biases;
}

OrderFit fitted(const std::vector<CellRecord>& cells) {
  const std::vector<OrderFit> fits = fit_orders(cells);
  EXPECT_EQ(fits.size(), 1u);
  return fits.at(0);
}

TEST(Order, ExactPowersAreMeasured) {
  for (const Real order : {1., 2., 3.}) {
    const OrderFit fit = fitted(marches(power(order, -0.01), order));
    EXPECT_EQ(fit.outcome, Outcome::pass);
    EXPECT_NEAR(fit.order, order, 1e-9);
    EXPECT_EQ(fit.steps, (std::vector<int>{8, 16, 32, 64}));
    EXPECT_EQ(fitted(marches(power(order + 1, 0.01), order)).outcome, Outcome::pass) << "better than claimed is no fault";
  }
}

TEST(Order, NamesHaveTheParametersOfTheTracker) {
  std::vector<CellRecord> cells = marches(power(1, 0.01), 1), others = cells;
  for (CellRecord& record : others)
    record.cell.estimator.edit([](Component& estimator) { estimator.values["offset"] = std::string("right"); });
  cells.insert(cells.end(), others.begin(), others.end());
  const std::vector<OrderFit> fits = fit_orders(cells);
  ASSERT_EQ(fits.size(), 2u);
  EXPECT_EQ(fits[0].name.find("ray_marching/offset:left/"), 0u) << fits[0].name;
  EXPECT_EQ(fits[1].name.find("ray_marching/offset:right/"), 0u) << fits[1].name;
}

TEST(Order, LessThanClaimedFails) {
  const OrderFit fit = fitted(marches(power(1, 0.01), 2));
  EXPECT_EQ(fit.outcome, Outcome::fail);
  EXPECT_NEAR(fit.order, 1, 1e-9);
  EXPECT_EQ(exit_of(marches(power(1, 0.01), 2)), ExitCode::bias_proven);
  // Nearly an exact power: the first terms of an expansion.
  EXPECT_EQ(fitted(marches(power(1, 0.01, 0.01), 2)).outcome, Outcome::fail);
  EXPECT_EQ(fitted(marches(power(1, 0.01, 0.01), 1)).outcome, Outcome::pass);
}

TEST(Order, IsNotResolvedByNoise) {
  // Standard errors of 2e-3: the biases .02, .005, ... of order 2 stand out once.
  const OrderFit fit = fitted(marches(power(2, 0.02), 2, 1));
  EXPECT_EQ(fit.outcome, Outcome::inconclusive);
  EXPECT_NE(fit.reason.find("1 of 4"), std::string::npos) << fit.reason;
  EXPECT_EQ(fitted(marches(power(2, 1e-13), 2)).outcome, Outcome::inconclusive) << "no bias beyond the reference's error";
  // Three points that stand out barely: a wide interval, which holds both the claim and less.
  EXPECT_EQ(fitted(marches(power(1, 0.034), 1, 1)).outcome, Outcome::inconclusive);
  EXPECT_TRUE(fit_orders(marches({{8, 0.01}, {16, 0.005}}, 1)).empty());
}

/// Lanes and majorants change no sample of a march: a copy tells nothing new.
TEST(Order, CopiesDoNotNarrowTheInterval) {
  const std::vector<CellRecord> once = marches(power(2, 0.2), 2, 1);
  std::vector<CellRecord> thrice = once;
  for (int i = 0; i < 2; ++i) thrice.insert(thrice.end(), once.begin(), once.end());
  ASSERT_EQ(fitted(once).outcome, Outcome::pass);
  EXPECT_EQ(fitted(thrice).half_width, fitted(once).half_width);
  // The best known cell counts.
  std::vector<CellRecord> more = marches(power(2, 0.2), 2, 1);
  for (CellRecord& cell : more) cell.samples *= 4;
  more.insert(more.begin(), once.begin(), once.end());
  EXPECT_LT(fitted(more).half_width, fitted(once).half_width);
}

TEST(Order, IsNotAskedInFloat) {
  std::vector<CellRecord> cells = marches(power(0, 1e-7), 2);
  for (CellRecord& cell : cells) cell.cell.precision = Precision::float32;
  EXPECT_TRUE(fit_orders(cells).empty());
}

TEST(Order, IsAClaimOfSmallSteps) {
  // Steps that begin to see the detail: the order still grows, and the noise of the last bias hides that no power fits.
  const OrderFit growing = fitted(marches({{1, 0.0416}, {2, 0.0086}, {4, 0.00135}}, 6, 0.005));
  EXPECT_EQ(growing.outcome, Outcome::inconclusive);
  EXPECT_LT(growing.order + growing.half_width, 5);
  EXPECT_NE(growing.reason.find("between the two finest steps; take finer ones"), std::string::npos) << growing.reason;
  // The finest steps may be of the claimed order.
  EXPECT_EQ(fitted(marches({{1, 0.04}, {2, 0.015}, {4, 0.0042}}, 2, 0.05)).outcome, Outcome::inconclusive);
  EXPECT_NE(fitted(marches({{8, 0.01}, {16, 0.005}, {32, -0.0025}}, 2)).reason.find("changes its sign"), std::string::npos);
  // On a deep medium a right-hand rule sees nothing at first, and a left-hand one many times T: orders of the optical depth.
  for (const Real depth : {-20., 20.}) EXPECT_NEAR(fitted(marches(power(1, depth), 1)).order, 1, 1e-6);
  // Steps that skip a medium's detail.
  EXPECT_EQ(fitted(marches({{1, 0.01}, {2, -0.04}, {4, 0.01}, {8, 0.02}}, 1)).outcome, Outcome::inconclusive);
  // Samples cut to 8 bits have a bias of that.
  std::vector<CellRecord> cells = marches(power(0, 0.002), 1);
  for (CellRecord& cell : cells) cell.cell.measurement.quantise_bits = 8;
  EXPECT_TRUE(fit_orders(cells).empty());
}

TEST(Order, SeriesDifferInNothingButTheirSteps) {
  std::vector<CellRecord> cells = marches(power(1, 0.01), 1);
  for (CellRecord other : marches(power(1, 0.03), 1)) {
    other.cell.estimator.edit([](Component& estimator) { estimator.values["jitter"] = 0.5; });
    cells.push_back(other);
  }
  ASSERT_EQ(fit_orders(cells).size(), 2u);
  for (const OrderFit& fit : fit_orders(cells)) EXPECT_NEAR(fit.order, 1, 1e-9);
  // The same steps again, such as under other majorants, are no further number of steps.
  EXPECT_TRUE(fit_orders(marches({{8, 0.01}, {8, 0.01}, {8, 0.0101}, {16, 0.01}}, 1)).empty());
  const OrderFit noisy = fitted(marches({{8, 1e-13}, {8, 1e-13}, {16, 1e-13}, {32, 1e-13}}, 1));
  EXPECT_NE(noisy.reason.find("at 0 of 3 numbers of steps"), std::string::npos) << noisy.reason;
  // Others claim no order.
  for (CellRecord& cell : cells) cell.claims = "unbiased";
  EXPECT_TRUE(fit_orders(cells).empty());
}

}  // namespace
}  // namespace nullmark
