#include "harness/verdict/replay_law.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "harness/verdict/walk_laws.h"

namespace nullmark {
namespace {

/// Where samples are long, fewer are drawn again: about so many lookups of a cell, and its first and last sample always.
constexpr Real kLookups = 1 << 16;

/// NaN has many representations; a cell that draws one is an error already.
bool same(Real a, Real b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}

}  // namespace

LawRecord replay_law(const Cell& cell, const Scene& scene, const Kernel& kernel, std::span<const KeptSamples> kept,
                     const std::function<bool()>& stop) {
  LawRecord law{"replay", 0, 0, Outcome::none};
  const std::uint64_t key = stream_key(cell, *scene.medium);
  const auto workspace = kernel.workspace();
  workspace->stop = stop;
  PreparedRay context;
  SampleBlock block;
  Counters counters;
  for (const KeptSamples& samples : kept) {
    std::size_t begun = scene.rays->world.size();  // the ray at hand; none yet
    std::size_t step = 1;
    for (std::size_t i = samples.count(); i-- > 0;) {
      if (i % step != 0) continue;
      const KeptSamples::Sample sample = samples.at(i);
      if (sample.ray != begun) {
        if (stop()) return {"replay", 0, 0, Outcome::none};
        begun = sample.ray;
        scene.context(begun, kernel, context);
        kernel.begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
      }
      const std::uint64_t before = sample.number > 0 ? i % 2 : 0;
      kernel.sample(*workspace, *scene.medium->medium, context, key, sample.number - before, before + 1, cell.quantity, block,
                    counters);
      const Real* again = &block.values[before * sample.values.size()];
      if (!std::equal(sample.values.begin(), sample.values.end(), again, same)) law.log_e = kCertain;
      ++law.samples;
      const Real each = static_cast<Real>(counters.lookups) / static_cast<Real>(counters.samples);
      step = static_cast<std::size_t>(std::max<Real>(1, std::ceil(each * static_cast<Real>(samples.count()) / kLookups)));
    }
  }
  if (stop()) return {"replay", 0, 0, Outcome::none};
  return law;
}

}  // namespace nullmark
