#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "media/volumes/zeroed_pages.h"

namespace nullmark {

/// A table of numbers that costs memory, and time to walk, where something was set; elsewhere it holds 0.
class SparseTable {
 public:
  explicit SparseTable(std::size_t size = 0) : numbers_(size), used_((size + kBlock - 1) / kBlock) {}

  std::size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  const std::uint32_t* data() const { return numbers_.data(); }
  std::uint32_t operator[](std::size_t at) const { return numbers_[at]; }

  void set(std::size_t begin, std::size_t end, std::uint32_t number) {
    std::fill(numbers_.data() + begin, numbers_.data() + end, number);
    if (begin < end) std::fill(used_.data() + begin / kBlock, used_.data() + (end - 1) / kBlock + 1, char{1});
  }

  /// How far from `begin` on, at most to `end`, nothing was ever set; found block by block, so it may be less.
  std::size_t unset_until(std::size_t begin, std::size_t end) const {
    if (begin >= end) return end;
    const char* const first = used_.data() + begin / kBlock;
    const char* const found = std::find(first, used_.data() + (end - 1) / kBlock + 1, char{1});
    return std::clamp(static_cast<std::size_t>(found - used_.data()) * kBlock, begin, end);
  }

 private:
  static constexpr std::size_t kBlock = 512;

  std::vector<std::uint32_t, ZeroedPages<std::uint32_t>> numbers_;
  std::vector<char> used_;  ///< block by block
};

}  // namespace nullmark
