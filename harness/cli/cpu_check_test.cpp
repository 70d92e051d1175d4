// A program for another CPU says so.  That it does before any other of its instructions, an emulated CPU shows:
// qemu-x86_64 -cpu Nehalem build/count/nullmark
#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "harness/cli/cpu_features.h"

#if defined(__x86_64__)

namespace nullmark {
namespace {

#define NULLMARK_LACKED(name, macro) lacked.push_back(!__builtin_cpu_supports(name));
#define NULLMARK_NONE(name, macro) false,
#define NULLMARK_NAME(name, macro) name,

TEST(CpuCheck, RefusesAFeatureThatThisCpuLacks) {
  std::vector<char> lacked;
  NULLMARK_CPU_FEATURES(NULLMARK_LACKED)
  bool needed[] = {NULLMARK_CPU_FEATURES(NULLMARK_NONE)};
  check_cpu(needed);
  int refused = 0;
  for (std::size_t i = 0; i < lacked.size(); ++i) {
    needed[i] = true;
    if (lacked[i]) {
      EXPECT_EXIT(check_cpu(needed), testing::ExitedWithCode(2), "^nullmark: this CPU lacks [a-z0-9.]+, which [^\n]*\n$");
      ++refused;
    } else {
      check_cpu(needed);
    }
    needed[i] = false;
  }
  // xop and avx512bitalg are of CPUs that differ.
  EXPECT_GT(refused, 0);
}

TEST(CpuCheck, KnowsTheInstructionSetOfTheBuild) {
  const auto needs = [&](std::string_view feature) {
    std::size_t i = 0;
    for (const std::string_view name : {NULLMARK_CPU_FEATURES(NULLMARK_NAME)}) {
      if (name == feature) return kNeededFeatures[i];
      ++i;
    }
    return false;
  };
#ifdef __AVX2__
  EXPECT_TRUE(needs("avx2"));
#else
  EXPECT_FALSE(needs("avx2"));
#endif
#ifdef __AVX512F__
  EXPECT_TRUE(needs("avx512f"));
#else
  EXPECT_FALSE(needs("avx512f"));
#endif
}

}  // namespace
}  // namespace nullmark

#endif
