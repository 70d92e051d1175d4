#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "media/base/parameters.h"
#include "media/base/registry.h"
#include "media/base/types.h"

namespace nullmark {

/// Rays in the world frame, unit directions, not yet cut to a medium.  Pixel grids run row by row from the lowest row of the
/// image.
struct RaySet {
  std::vector<Ray> rays;
  int width = 0, height = 0;  ///< 0 x 0 if the rays form no image
};

/// Makes a set of rays for the world bounds of a medium.
class RaySetSource {
 public:
  virtual ~RaySetSource() = default;
  virtual void parameters(ParameterVisitor& visit) = 0;
  /// Number of rays that `rays` makes.
  virtual std::size_t count() const = 0;
  virtual RaySet rays(const Box& world_bounds) const = 0;
};

/// Registered: single, orthographic, perspective, chords, inside.
struct RaySetEntry {
  std::string name, summary, source;
  std::unique_ptr<RaySetSource> (*make)() = nullptr;
};

}  // namespace nullmark
