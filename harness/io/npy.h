#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// The header of an .npy file: numbers in C order, little-endian, of 4 or 8 bytes.
struct NpyHeader {
  std::size_t bytes_per_number = 8;
  std::vector<std::uint64_t> shape;
  std::uint64_t begin = 0;    ///< of the numbers, in the file
  std::uint64_t numbers = 0;  ///< the product of the shape
};

/// Reads and checks the header, and that the file has the size that it tells.  Versions 1 and 2, '<f4' or '<f8', C order.  Throws
/// InputError of one line for anything else.
NpyHeader read_npy_header(const std::string& path);

/// Reads the numbers in their order, some at a time: calls `take` with the place of the first and the numbers.  Throws
/// InputError.
void read_npy(const std::string& path, const NpyHeader& header,
              const std::function<void(std::uint64_t first, std::span<const Real> numbers)>& take);

/// The bytes of an .npy file of doubles.  `numbers` has as many as the shape says.
std::string npy_text(const std::vector<std::uint64_t>& shape, std::span<const Real> numbers);

}  // namespace nullmark
