#include "media/base/philox.h"

#include <Random123/philox.h>
#include <gtest/gtest.h>

#include <random>

#undef philox4x32  // Random123 has a macro of that name

namespace nullmark {
namespace {

using Counter = std::array<std::uint32_t, 4>;
using Key = std::array<std::uint32_t, 2>;

// Known answers published with Random123 (kat_vectors), at compile time.
static_assert(philox4x32({0, 0, 0, 0}, {0, 0}) == Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
static_assert(philox4x32({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}) == Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
static_assert(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
              Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});

TEST(Philox, EqualsRandom123) {
  std::mt19937 random(1);
  const auto word = [&] { return static_cast<std::uint32_t>(random()); };
  for (int i = 0; i < 10000; ++i) {
    const Counter counter = {word(), word(), word(), word()};
    const Key key = {word(), word()};
    const r123::Philox4x32::ctr_type c = {{counter[0], counter[1], counter[2], counter[3]}};
    const r123::Philox4x32::key_type k = {{key[0], key[1]}};
    const auto expected = r123::Philox4x32()(c, k);
    const Counter found = philox4x32(counter, key);
    for (std::size_t w = 0; w < 4; ++w) ASSERT_EQ(found[w], expected[w]);
  }
}

TEST(Philox, EveryInputWordMatters) {
  const Counter base = philox4x32({1, 2, 3, 4}, {5, 6});
  for (std::size_t w = 0; w < 4; ++w) {
    Counter counter = {1, 2, 3, 4};
    counter[w] ^= 1u << 31;
    EXPECT_NE(philox4x32(counter, {5, 6}), base);
  }
  EXPECT_NE(philox4x32({1, 2, 3, 4}, {5 ^ (1u << 31), 6}), base);
  EXPECT_NE(philox4x32({1, 2, 3, 4}, {5, 6 ^ (1u << 31)}), base);
}

}  // namespace
}  // namespace nullmark
