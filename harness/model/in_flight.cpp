#include "harness/model/in_flight.h"

#include <signal.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <new>

namespace nullmark {
namespace {

/// What each thread works on; threads beyond so many are not told of.
constinit std::array<std::atomic<const char*>, 256> slots{};
constinit std::array<std::atomic<bool>, 256> taken{};

/// A thread's slot, and where its handlers of signals run when its own stack is used up.
class ThreadState {
 public:
  ThreadState() noexcept : memory_(new (std::nothrow) std::byte[kSize]) {
    for (std::size_t i = 0; i < taken.size() && !slot_; ++i)
      if (!taken[i].exchange(true)) slot_ = &slots[i], taken_ = &taken[i];
    stack_t now{};
    // The main thread, or a sanitizer, may have one.
    if (!memory_ || ::sigaltstack(nullptr, &now) != 0 || !(now.ss_flags & SS_DISABLE)) return;
    stack_t stack{};
    stack.ss_sp = memory_.get();
    stack.ss_size = kSize;
    stacked_ = ::sigaltstack(&stack, nullptr) == 0;
  }
  ~ThreadState() {
    if (slot_) *taken_ = false;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    if (stacked_) ::sigaltstack(&none, nullptr);
  }
  ThreadState(const ThreadState&) = delete;
  ThreadState& operator=(const ThreadState&) = delete;

  std::atomic<const char*>* slot() const { return slot_; }

 private:
  static constexpr std::size_t kSize = std::size_t{1} << 16;
  std::unique_ptr<std::byte[]> memory_;
  std::atomic<const char*>* slot_ = nullptr;
  std::atomic<bool>* taken_ = nullptr;
  bool stacked_ = false;
};

constinit thread_local const char* of_this_thread = nullptr;

void publish(const char* name) noexcept {
  static thread_local const ThreadState state;
  of_this_thread = name;
  if (state.slot()) state.slot()->store(name, std::memory_order_relaxed);
}

}  // namespace

InFlight::InFlight(const std::string& cell) noexcept : before_(of_this_thread) { publish(cell.c_str()); }

InFlight::~InFlight() { publish(before_); }

const char* InFlight::cell() noexcept {
  if (of_this_thread) return of_this_thread;
  for (const std::atomic<const char*>& slot : slots)
    if (const char* name = slot.load(std::memory_order_relaxed)) return name;
  return nullptr;
}

std::set<std::string> InFlight::cells() {
  std::set<std::string> names;
  for (const std::atomic<const char*>& slot : slots)
    if (const char* name = slot.load(std::memory_order_relaxed)) names.insert(name);
  return names;
}

}  // namespace nullmark
