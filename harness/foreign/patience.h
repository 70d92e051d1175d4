#pragma once

#include <hwy/cache_control.h>

#include <algorithm>
#include <chrono>

namespace nullmark {

/// How long one side asks for the other's frame before it sleeps: 100 us, because to be woken takes longer than most answers.  If
/// no frame came, others may need the processor, and the next frames are waited for asleep: 1, then 3, then 7 and up to 255.
class Patience {
 public:
  /// Called whenever there is no frame yet: whether to ask again at once.
  bool asks_again() {
    const auto now = Clock::now();
    if (!waiting_) {
      waiting_ = true;
      asks_ = rest_ == 0;
      if (!asks_) --rest_;
      until_ = now + std::chrono::microseconds(100);
    }
    if (asks_ && now < until_) {
      hwy::Pause();
      return true;
    }
    if (asks_) rest_ = in_vain_ = std::min(2 * in_vain_ + 1, 255);
    asks_ = false;
    return false;
  }

  void answered() {
    if (waiting_ && asks_) in_vain_ = 0;
    waiting_ = false;
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool waiting_ = false, asks_ = false;
  int rest_ = 0, in_vain_ = 0;
  Clock::time_point until_;
};

}  // namespace nullmark
