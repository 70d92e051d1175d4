#pragma once

#include <cstdint>

#include "harness/model/plan.h"

namespace nullmark {

/// Claims that the mean tests of a whole configuration make, two each, channel by channel and group by group, whatever is
/// selected to run; and those of its lookups tests.
std::uint64_t mean_family(const Plan& plan);
std::uint64_t lookups_family(const Plan& plan);

/// Laws that a whole configuration may test.
std::uint64_t laws_family(const Plan& plan);

/// How many laws a cell can be tested for, at most.
inline constexpr std::uint64_t kLaws = 11;

}  // namespace nullmark
