#pragma once

#include <utility>

#include "media/base/medium.h"

namespace nullmark {

/// Bounds over a whole medium: of its extinction, and from below of its parts mu_a and mu_s, per channel.
struct MatterBounds : Extrema {
  Spectrum least_absorption, least_scattering;
  bool albedo_varies = false;  ///< in space

  /// Of a medium that only absorbs.
  MatterBounds(Extrema extinction = {})
      : Extrema(std::move(extinction)), least_absorption(minimum), least_scattering(Spectrum::Zero(minimum.size())) {}
};

}  // namespace nullmark
