#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace nullmark {

/// Runs tasks one after another, in order, on a separate thread, so that waiting for a disk does not delay samples.  Whenever
/// none waits, it calls `drained`: a disk that keeps tasks waiting is asked once for all of them.  A task that throws is the
/// last.
class Background {
 public:
  explicit Background(std::function<void()> drained);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  void add(std::function<void()> task);
  bool failed() const { return failed_; }

  /// Waits for all tasks and rethrows what the last one threw.  No tasks may be added afterwards.
  void finish();

 private:
  void work();
  bool is_drained();

  std::function<void()> drained_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool closed_ = false;
  std::atomic<bool> failed_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace nullmark
