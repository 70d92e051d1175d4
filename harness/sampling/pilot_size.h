#pragma once

#include <cstdint>

#include "harness/kernel/given_samples.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {

/// Samples of each ray that a pilot of the cell draws: as many as the cell, where the kernel has that many.
inline std::uint64_t pilot_size(const PreparedCell& prepared) {
  const auto* limited = dynamic_cast<const LimitedPilot*>(prepared.kernel.get());
  return limited ? limited->pilot_samples() : prepared.samples_per_ray;
}

}  // namespace nullmark
