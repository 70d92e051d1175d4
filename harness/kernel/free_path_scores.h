#pragma once

#include <algorithm>
#include <cstddef>

#include "estimators/walk/event.h"
#include "harness/kernel/kernel.h"
#include "media/base/value.h"

namespace nullmark {

/// Numbers per sample of a free path, all channels together: its bins, scatter where the medium scatters, escape, weight.
inline std::size_t free_path_outputs(const Spectrum& albedo, std::size_t channels) {
  return (kFreePathBins + (scatters(albedo) ? 3 : 2)) * channels;
}

/// Scores of a free path: its weight in the bin of its collision, in scatter if it scatters, in escape if it escapes, and in
/// weight.  `scatters_at(t)` chooses for collisions of open kind; samplers that leave the kind open are grey.
template <class Value, class Choice>
void score_free_path(const Event<Value>& event, const PreparedRay& context, std::size_t channels, Choice&& scatters_at,
                     Real* values) {
  std::fill(values, values + free_path_outputs(context.albedo, channels), Real{0});
  Real* const scattered = values + kFreePathBins * channels;
  Real* const escaped = scattered + (scatters(context.albedo) ? channels : 0);
  store(event.weight, escaped + channels);
  if (event.kind == EventKind::escape) store(event.weight, escaped);
  if (!is_collision(event.kind)) return;
  const auto after = std::upper_bound(context.marks.begin(), context.marks.end(), event.distance);
  const auto cell = std::clamp<std::ptrdiff_t>(after - context.marks.begin() - 1, 0, kFreePathCells - 1);
  store(event.weight, values + static_cast<std::size_t>(cell) / (kFreePathCells / kFreePathBins) * channels);
  if (!scatters(context.albedo)) return;
  if (event.kind == EventKind::scatter || (event.kind == EventKind::collision && scatters_at(event.distance)))
    store(event.weight, scattered);
}

}  // namespace nullmark
