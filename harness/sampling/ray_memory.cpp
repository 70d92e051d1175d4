#include "harness/sampling/ray_memory.h"

#include <fmt/format.h>

#include <set>

#include "harness/registry/components.h"
#include "harness/sampling/sampling.h"
#include "harness/statistics/moments.h"
#include "media/volumes/machine_memory.h"

namespace nullmark {
namespace {

/// Of rays that cells of one medium share: in both frames, with a reference of one channel.
constexpr Real kSharedBytes = 2 * sizeof(Ray) + 2 * sizeof(Real);
/// Of a cell until the end: target and theory of one output.
constexpr Real kBytesOfCell = 6 * sizeof(Real);
/// Of a cell while it is sampled.
constexpr Real kSampledBytes = sizeof(Moments) + 3 * sizeof(Real);

constexpr Real kGigabyte = 1e9;

}  // namespace

void expect_rays_fit(const Plan& plan, const std::function<bool(std::size_t)>& wanted) {
  const Real machine = static_cast<Real>(machine_memory());
  std::set<std::array<std::size_t, 2>> built;
  Real kept = 0;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    if (!wanted(i)) continue;
    const Cell& cell = plan.cells[i];
    const Component& set = *plan.ray_sets[cell.rays];
    const auto rays = static_cast<Real>(make_ray_set(set)->count());
    kept += rays * kBytesOfCell;
    if (built.insert({cell.medium, cell.rays}).second) kept += rays * kSharedBytes;
    if (const Real least = kept + rays * kSampledBytes; least > machine)
      throw ParameterError(set.pointer,
                           fmt::format("{:.0f} rays, with those of the cells before them, take at least {:.1f} GB and "
                                       "this machine has {:.1f} GB; make fewer rays, or run the cells in parts with "
                                       "--shard",
                                       rays, least / kGigabyte, machine / kGigabyte));
  }
}

}  // namespace nullmark
