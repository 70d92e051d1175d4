#pragma once

#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Writes values (row by row from the lowest row, `channels` 1 or 3 numbers per pixel) as an 8-bit PNG: 0 black, `maximum`
/// and above white; values that are not finite are magenta.  `display` encodes with the transfer curve of sRGB (IEC 61966-2-1),
/// for pictures of light.  Throws std::runtime_error when the file cannot be written.
void write_png(const std::string& path, int width, int height, int channels, const std::vector<Real>& values, Real maximum,
               bool display = false);

/// One layer of an image: a name and one number per pixel, row by row from the lowest row.
struct Layer {
  std::string name;
  std::vector<Real> values;
};

/// Writes layers as 32-bit float channels of an OpenEXR file, losslessly compressed.  Throws std::runtime_error when the file
/// cannot be written.
void write_exr(const std::string& path, int width, int height, const std::vector<Layer>& layers);

struct LayeredImage {
  int width = 0, height = 0;
  std::vector<Layer> layers;
};

/// Reads the channels of an OpenEXR file; all must be 32-bit floats with one number per pixel.  Throws std::runtime_error when it
/// cannot be read or is larger than 2^26 numbers.
LayeredImage read_exr(const std::string& path);

}  // namespace nullmark
