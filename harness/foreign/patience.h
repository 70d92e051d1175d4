#pragma once

#include <sched.h>

#include <chrono>

namespace nullmark {

/// How long to ask again for the other side's frame before sleeping: to be woken takes longer than most answers.  The processor is
/// yielded meanwhile, for the other side may need it.
class Patience {
 public:
  /// Whether to ask again, once others have run.
  bool yields() {
    const auto now = Clock::now();
    if (!began_) until_ = now + std::chrono::microseconds(100);
    began_ = true;
    if (now > until_) return false;
    ::sched_yield();
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool began_ = false;
  Clock::time_point until_;
};

}  // namespace nullmark
