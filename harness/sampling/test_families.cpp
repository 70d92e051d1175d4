#include "harness/sampling/test_families.h"

#include <algorithm>

#include "harness/kernel/kernel.h"
#include "harness/sampling/test_plan.h"

namespace nullmark {
namespace {

/// Upper bound on the number of ray groups, from the specification alone.
std::uint64_t possible_groups(const Component& rays) { return rays.type == "single" ? 0 : kRayGroups; }

/// Upper bound on the outputs of a quantity, for each channel.
std::uint64_t outputs_per_channel(Quantity quantity) {
  if (quantity == Quantity::transmittance_profile) return kProfileMarks;
  return quantity == Quantity::free_path ? kFreePathBins + 3 : 1;
}

std::uint64_t channels_of(const MediumSpec& medium) {
  if (medium.field.type == "channels") return medium.per_channel.size();
  return std::max<std::size_t>(1, medium.spectrum.size());
}

}  // namespace

/// A test of a mean makes two claims that can be false alarms: "biased" and "beyond epsilon".
constexpr std::uint64_t kClaims = 2;

std::uint64_t mean_family(const Plan& plan) {
  std::uint64_t tests = 0;
  for (const Cell& cell : plan.cells)
    if (cell.verdict.enabled)
      tests += channels_of(*plan.media[cell.medium]) * outputs_per_channel(cell.quantity) *
               (1 + possible_groups(*plan.ray_sets[cell.rays])) * kClaims;
  return std::max<std::uint64_t>(1, tests);
}

std::uint64_t lookups_family(const Plan& plan) {
  std::uint64_t tests = 0;
  for (const Cell& cell : plan.cells) tests += kClaims * cell.verdict.enabled;
  return std::max<std::uint64_t>(1, tests);
}

std::uint64_t laws_family(const Plan& plan) { return kLaws * lookups_family(plan) / kClaims; }

}  // namespace nullmark
