#include "harness/cli/signals.h"

#include <csignal>

namespace nullmark {

std::atomic<int> received_signal{0};

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = [](int number) { received_signal = number; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

}  // namespace nullmark
