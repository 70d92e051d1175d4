#include "harness/run/task_thread.h"

#include <utility>

namespace nullmark {

Background::Background(std::function<void()> drained) : drained_(std::move(drained)), thread_([this] { work(); }) {}

Background::~Background() {
  try {
    finish();
  } catch (...) {  // Whoever wants to know calls `finish`.
  }
}

void Background::add(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  changed_.notify_one();
}

void Background::finish() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (const std::exception_ptr error = std::exchange(error_, nullptr)) std::rethrow_exception(error);
}

bool Background::is_drained() {
  const std::lock_guard lock(mutex_);
  return tasks_.empty();
}

void Background::work() {
  for (;;) {
    std::function<void()> task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return closed_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    try {
      task();
      if (is_drained()) drained_();
    } catch (...) {
      error_ = std::current_exception();
      failed_ = true;
      return;
    }
  }
}

}  // namespace nullmark
