#pragma once

namespace nullmark {

/// The same for every command.
enum class ExitCode {
  ok = 0,
  internal_error = 1,
  input_error = 2,  ///< usage, configuration or input data
  bias_proven = 3,
  regression = 4,
  nothing_ran = 5,  ///< nothing selected, nothing ran, no baseline of that key
  inconclusive = 77,
  interrupted = 130,
  terminated = 143
};

}  // namespace nullmark
