#include "harness/run/watchdog.h"

#include <gtest/gtest.h>

#include <atomic>

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

TEST(Watchdog, LeavesWorkAloneThatEnds) {
  std::atomic<bool> bitten = false;
  {
    Watchdog dog([] { return true; }, [&] { bitten = true; });
    dog.claim();
  }
  {
    Watchdog dog([] { return false; }, [&] { bitten = true; });
  }
  EXPECT_FALSE(bitten);
}

TEST(Watchdog, BitesOnceWhereTheWorkDoesNotEndAndThenNobodyElseWrites) {
  std::atomic<int> bites = 0;
  // It holds whoever claims, so the test leaves both behind.
  auto* const dog = new Watchdog([] { return true; }, [&] { ++bites; });
  const auto begin = Clock::now();
  while (bites == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_GE(Clock::now() - begin, Watchdog::kPatience - std::chrono::milliseconds(1));
  static std::atomic<bool> returned = false;
  std::thread([dog] {
    dog->claim();
    returned = true;
  }).detach();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_FALSE(returned);
  EXPECT_EQ(bites, 1);
}

}  // namespace
}  // namespace nullmark
