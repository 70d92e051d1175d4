#pragma once

#include <unistd.h>

#include <cstdint>

namespace nullmark {

/// Bytes of memory that this machine has.
inline std::uint64_t machine_memory() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace nullmark
