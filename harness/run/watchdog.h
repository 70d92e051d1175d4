#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace nullmark {

/// Ends work that does not end itself.  Samples ask now and then whether they should stop; a structure, a reference, a theory or
/// a plug-in may not ask for minutes.
class Watchdog {
 public:
  /// `due` tells whether the work should end, and stays true once it is.  Where the work has not ended some time later, `overdue`
  /// is called on a thread of its own, once, and must end the process.
  Watchdog(std::function<bool()> due, std::function<void()> overdue);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// To be called when the work has ended, before its results are written: from here on `overdue` is not called.  Where it has
  /// been, this does not return.
  void claim();

  static constexpr std::chrono::milliseconds kPatience{1400};

 private:
  void watch(const std::function<bool()>& due, const std::function<void()>& overdue);

  std::mutex mutex_;
  std::condition_variable changed_;
  bool claimed_ = false, overdue_ = false;
  std::thread thread_;
};

}  // namespace nullmark
