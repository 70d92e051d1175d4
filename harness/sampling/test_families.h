#pragma once

#include <cstdint>

#include "harness/model/plan.h"

namespace nullmark {

/// Number of claims of all mean tests of a configuration, two per channel and group, whatever is selected to run; and the number
/// for its lookup tests.
std::uint64_t mean_family(const Plan& plan);
std::uint64_t lookups_family(const Plan& plan);

/// Number of laws that a whole configuration can test.
std::uint64_t laws_family(const Plan& plan);

/// Largest number of laws that a cell can be tested for.
inline constexpr std::uint64_t kLaws = 11;

}  // namespace nullmark
