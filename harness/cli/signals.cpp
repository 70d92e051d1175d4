#include "harness/cli/signals.h"

#include <csignal>
#include <ctime>

namespace nullmark {

std::atomic<int> received_signal{0};

namespace {

/// Seconds of the first signal.
std::atomic<double> first_at{0};

double now() {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void receive(int number) {
  if (received_signal == 0) {
    first_at = now();
    received_signal = number;
  } else if (now() - first_at >= kOneSignalSeconds) {
    ::signal(number, SIG_DFL);
    ::raise(number);
  }
}

}  // namespace

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = receive;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

}  // namespace nullmark
