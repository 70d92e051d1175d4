#pragma once

#include <atomic>

namespace nullmark {

/// SIGINT or SIGTERM, once either has arrived; else 0.
extern std::atomic<int> received_signal;

/// `timeout` of coreutils, and many shells, send a signal to the program and to its group: signals that arrive together are one.
inline constexpr double kOneSignalSeconds = 0.5;

/// Has SIGINT and SIGTERM end the run after the samples under way; a second one ends the program at once.
void catch_signals();

}  // namespace nullmark
