#include "harness/run/watchdog.h"

#include <optional>
#include <utility>

namespace nullmark {
namespace {

constexpr std::chrono::milliseconds kLook{20};

}  // namespace

Watchdog::Watchdog(std::function<bool()> due, std::function<void()> overdue)
    : thread_([this, due = std::move(due), overdue = std::move(overdue)] { watch(due, overdue); }) {}

Watchdog::~Watchdog() {
  claim();
  thread_.join();
}

void Watchdog::claim() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !overdue_; });
  claimed_ = true;
  changed_.notify_all();
}

void Watchdog::watch(const std::function<bool()>& due, const std::function<void()>& overdue) {
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> since;
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [&] { return claimed_; })) {
    if (!since && due()) since = Clock::now();
    if (!since || Clock::now() - *since < kPatience) continue;
    overdue_ = true;
    lock.unlock();
    overdue();
    return;
  }
}

}  // namespace nullmark
