#include "estimators/walk/flight.h"

#include <gtest/gtest.h>

#include <deque>

#include "estimators/walk/rng.h"

namespace nullmark {
namespace {

/// Hands out exponentials that the test chooses.
struct Scripted {
  std::deque<Real> values;
  Real exponential() {
    const Real value = values.front();
    values.pop_front();
    return value;
  }
};

Rates two_rates() {
  Rates rates;
  rates.start(1);
  rates.append(2, 3);  // depth 3
  rates.append(4, 0);  // nothing
  rates.append(5, 2);  // depth 2
  return rates;
}

TEST(Flight, CarriesTheLeftoverAcrossCellsAndPassesOverZeroRates) {
  const Rates rates = two_rates();
  Flight flight;
  flight.start(rates);
  Scripted rng{{1.5, 2.5, 1}};
  ASSERT_TRUE(flight.next(rng));
  EXPECT_DOUBLE_EQ(flight.position(), 1.5);
  EXPECT_EQ(flight.rate(), 3);
  EXPECT_DOUBLE_EQ(flight.depth_left(), 3.5);
  ASSERT_TRUE(flight.next(rng));
  EXPECT_DOUBLE_EQ(flight.position(), 4.5);  // 1.5 of depth to the end of the first cell, 1 in the third
  EXPECT_EQ(flight.rate(), 2);
  EXPECT_FALSE(flight.next(rng));  // a flight that ends exactly at the ray's end has left
  EXPECT_EQ(flight.position(), 5);
}

TEST(Flight, RewindsToEveryCellsEndAndDrawsAnewThereButNotForZeroRates) {
  Rates rates;
  rates.start(1, Crossing::rewind);
  rates.append(2, 3);  // depth 3
  rates.append(4, 0);  // nothing
  rates.append(5, 2);  // depth 2
  rates.append(6, 0);
  Flight flight;
  flight.start(rates);
  Scripted rng{{1.5, 2.5, 1, 7}};
  ASSERT_TRUE(flight.next(rng));
  EXPECT_DOUBLE_EQ(flight.position(), 1.5);
  ASSERT_TRUE(flight.next(rng));  // 2.5 leaves the first cell, 1 counts from the third cell's begin
  EXPECT_DOUBLE_EQ(flight.position(), 4.5);
  EXPECT_DOUBLE_EQ(flight.depth(), 4);
  EXPECT_EQ(flight.rate(), 2);
  EXPECT_FALSE(flight.next(rng));
  EXPECT_EQ(flight.position(), 6);
  EXPECT_EQ(flight.depth_left(), 0);
  EXPECT_TRUE(rng.values.empty());
  flight.start(rates);
  rng.values = {3, 0, 2};  // exactly to the ends
  ASSERT_TRUE(flight.next(rng));
  EXPECT_EQ(flight.position(), 4);
  EXPECT_FALSE(flight.next(rng));
}

/// Rewinding leaves the law of the depths alone and adds one draw per cell left: K ~ Poisson(20) collisions, and the draws K + 64
/// exactly.  K's mean over 20000 flights within 5.5 standard errors (4e-8).
TEST(Flight, RewindingCostsOneDrawPerCellAndKeepsTheCount) {
  Rates rates;
  rates.start(0, Crossing::rewind);
  for (int i = 1; i <= 64; ++i) rates.append(i / 64., 20);
  constexpr int kFlights = 20000;
  Real collisions = 0;
  for (std::uint64_t sample = 0; sample < kFlights; ++sample) {
    Rng rng(SampleAddress{1, 2, sample});
    Flight flight;
    flight.start(rates);
    std::uint64_t count = 0;
    while (flight.next(rng)) ++count;
    ASSERT_EQ(rng.draws(), count + 64);
    collisions += static_cast<Real>(count);
  }
  EXPECT_NEAR(collisions / kFlights, 20, 5.5 * std::sqrt(20. / kFlights));
}

TEST(Flight, TravelsBothWaysToWhereItLands) {
  Rates rates;
  rates.start(0);
  for (int i = 0; i < 20; ++i) rates.append(i + 1, i % 4 == 1 ? 0 : 1 + i % 3);
  Rng rng(SampleAddress{3, 1, 4});
  Flight travels, lands;
  travels.start(rates);
  lands.start(rates);
  const Real total = rates.total_depth();
  // Ends of cells and depths beyond the ray's end as well.
  for (int i = 0; i < 500; ++i) {
    const Real depth = i % 5 == 0 ? rates.depth_before(static_cast<std::size_t>(i / 5) % 20) : rng.uniform() * total * 1.05;
    ASSERT_EQ(travels.travel_to(depth), lands.land(depth)) << depth;
    ASSERT_EQ(travels.position(), lands.position()) << depth;
    if (depth < total) {
      ASSERT_EQ(travels.piece(), lands.piece()) << depth;
    }
  }
}

TEST(Flight, ZeroExponentialsStayWhereTheyAre) {
  const Rates rates = two_rates();
  Flight flight;
  flight.start(rates);
  Scripted rng{{0, 3, 0}};
  ASSERT_TRUE(flight.next(rng));
  EXPECT_EQ(flight.position(), 1);
  ASSERT_TRUE(flight.next(rng));
  EXPECT_EQ(flight.position(), 4);  // a depth on a boundary belongs to the next cell that has a rate
  ASSERT_TRUE(flight.next(rng));
  EXPECT_EQ(flight.position(), 4);
}

TEST(Flight, VacuumAndEmptyRaysEndAtOnce) {
  Scripted rng{{1, 1, 1, 1}};
  Rates none;
  none.start(2);
  Flight flight;
  flight.start(none);
  EXPECT_EQ(flight.rate(), 0) << "before the first flight";
  EXPECT_FALSE(flight.next(rng));
  EXPECT_EQ(flight.rate(), 0);
  Rates vacuum;
  vacuum.start(0);
  vacuum.append(kInfinity, 0);
  flight.start(vacuum);
  EXPECT_FALSE(flight.next(rng));
  EXPECT_EQ(vacuum.total_depth(), 0);
  for (const Real end : {2., kInfinity}) {
    vacuum.start(0, Crossing::rewind);
    if (end < kInfinity) vacuum.append(end, 0);
    flight.start(vacuum);
    EXPECT_FALSE(flight.next(rng));
  }
  EXPECT_TRUE(rng.values.empty());  // one draw each, under either rule
}

TEST(Flight, AnInfiniteRayHasInfiniteDepth) {
  Rates rates;
  rates.start(0);
  rates.append(1, 0);
  rates.append(kInfinity, 2);
  Flight flight;
  flight.start(rates);
  Scripted rng{{4}};
  ASSERT_TRUE(flight.next(rng));
  EXPECT_DOUBLE_EQ(flight.position(), 3);
  EXPECT_EQ(flight.depth_left(), kInfinity);
}

TEST(Flight, APartitionOfAConstantRateChangesNothing) {
  Rates whole, parts;
  whole.start(0);
  whole.append(1, 20);
  parts.start(0);
  for (int i = 1; i <= 64; ++i) parts.append(i / 64., 20);
  for (std::uint64_t sample = 0; sample < 1000; ++sample) {
    Rng a(SampleAddress{1, 2, sample}), b(SampleAddress{1, 2, sample});
    Flight f, g;
    f.start(whole);
    g.start(parts);
    for (;;) {
      const bool more = f.next(a);
      ASSERT_EQ(more, g.next(b));
      if (!more) break;
      ASSERT_NEAR(f.position(), g.position(), 1e-13);
    }
    EXPECT_EQ(a.draws(), b.draws());
  }
}

}  // namespace
}  // namespace nullmark
