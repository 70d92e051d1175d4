#pragma once

#include <cmath>

#include "media/base/medium.h"
#include "media/base/parameters.h"

namespace nullmark {

/// Throws ParameterError where `rate`, what bounds a medium's extinction somewhere, is none.
inline void expect_finite(Real rate) {
  if (!std::isfinite(rate))
    throw ParameterError("type", "the medium's extinction has no finite bound; use the majorant \"prescribed\"");
}

/// Diagonal of a box of the medium's coordinates with edges `extent`, in world length.
inline Real world_diagonal(const Medium& medium, const Vec3& extent) {
  return (medium.world_to_local().inverse().linear() * extent).norm();
}

}  // namespace nullmark
