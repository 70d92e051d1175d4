#pragma once

#include <atomic>

namespace nullmark {

/// SIGINT or SIGTERM, once either has arrived; else 0.
extern std::atomic<int> received_signal;

/// Has SIGINT and SIGTERM end the run after the samples under way; a second one ends the program at once.
void catch_signals();

}  // namespace nullmark
