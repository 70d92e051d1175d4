#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace nullmark {

struct SpawnRequest {
  std::vector<std::string> command;
  std::string folder;  ///< working directory; empty: this process's
  int input = -1, output = -1, errors = -1;
  int memory = -1;          ///< becomes descriptor 3; -1: none
  std::uint64_t bytes = 0;  ///< limit on the address space; 0: none
};

struct SpawnResult {
  pid_t process = -1;
  int error = 0;  ///< errno of the start
};

/// Starts a process in a group of its own that is killed when this program ends, however it ends.  All are started by one thread
/// that lives as long as the program, because the kernel ties the death signal to the thread that forks.
SpawnResult spawn(const SpawnRequest& request);

}  // namespace nullmark
