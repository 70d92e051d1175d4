#pragma once

#include <gtest/gtest.h>

#include <boost/math/distributions/binomial.hpp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "harness/sampling/reference_loops.h"

/// How often verdicts are wrong: counts of errors against nominal rates.  The seeds are fixed; NULLMARK_FRESH_SEED=N draws other
/// samples.
namespace nullmark::false_alarms_test {

/// Unoptimised builds and sanitizers take a sample of the sample.
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
inline constexpr std::uint64_t kThin = 1;
#else
inline constexpr std::uint64_t kThin = 20;
#endif

/// A rate counts as above nominal where chance would show as many with less than this probability.
inline constexpr Real kSurprise = 1e-4;

inline std::uint64_t fresh_seed() {
  const char* text = std::getenv("NULLMARK_FRESH_SEED");
  return text ? std::strtoull(text, nullptr, 10) : 0;
}

inline PlainRng stream(std::uint64_t a, std::uint64_t b) { return PlainRng((fresh_seed() << 44) ^ (a << 22) ^ b); }

using Binomial = boost::math::binomial_distribution<Real>;

/// P(X >= count) of Binomial(trials, rate).
inline Real chance_of_as_many(std::uint64_t trials, std::uint64_t count, Real rate) {
  if (count == 0) return 1;
  return boost::math::cdf(boost::math::complement(Binomial(static_cast<Real>(trials), rate), static_cast<Real>(count) - 1));
}

/// Upper end of the one-sided 95 % Clopper-Pearson interval.
inline Real upper_bound(std::uint64_t trials, std::uint64_t count) {
  return Binomial::find_upper_bound_on_p(static_cast<Real>(trials), static_cast<Real>(count), 0.05);
}

inline void expect_not_above(const std::string& what, std::uint64_t trials, std::uint64_t count, Real nominal) {
  std::printf("%-58s %5llu of %6llu = %.5f (at most %.5f; nominal %g)\n", what.c_str(), static_cast<unsigned long long>(count),
              static_cast<unsigned long long>(trials), static_cast<double>(count) / static_cast<double>(trials),
              upper_bound(trials, count), nominal);
  EXPECT_GE(chance_of_as_many(trials, count, nominal), kSurprise) << what;
}

}  // namespace nullmark::false_alarms_test
