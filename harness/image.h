#pragma once

#include <string>
#include <vector>

#include "media/types.h"

namespace nullmark {

/// Writes values (row by row from the lowest row, `channels` 1 or 3 numbers a pixel) as an 8-bit PNG: 0 black, `maximum` white,
/// cut beyond; values that are not finite are magenta.  Throws std::runtime_error when the file cannot be written.
void write_png(const std::string& path, int width, int height, int channels, const std::vector<Real>& values, Real maximum);

}  // namespace nullmark
