#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <system_error>

namespace nullmark {

/// Path of the executable that runs; once a newer one has taken its place, of the one that runs.
inline std::string own_executable() {
  const char* const running = "/proc/self/exe";
  std::error_code error;
  const std::string named = std::filesystem::read_symlink(running, error).string();
  return !error && ::access(named.c_str(), X_OK) == 0 ? named : running;
}

}  // namespace nullmark
