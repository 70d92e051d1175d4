#include "harness/cli/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <csignal>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "harness/foreign/library.h"
#include "harness/io/json_input.h"
#include "harness/model/in_flight.h"

namespace nullmark {
namespace {

/// Puts one line together without memory of the heap, which a crash may have left locked.
class SignalSafeLine {
 public:
  SignalSafeLine& operator<<(const char* text) {
    // Names of plug-ins' parameters are of any length; line breaks in them would make it several lines.
    for (; *text && size_ + 1 < text_.size(); ++text) text_[size_++] = *text == '\n' ? ' ' : *text;
    return *this;
  }
  SignalSafeLine& operator<<(int number) {
    char digits[12];
    int at = sizeof digits;
    digits[--at] = '\0';
    do digits[--at] = static_cast<char>('0' + number % 10);
    while ((number /= 10) > 0);
    return *this << &digits[at];
  }
  void write() {
    text_[size_++] = '\n';
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text_.data(), size_);
  }

 private:
  std::array<char, 2048> text_;
  std::size_t size_ = 0;
};

std::atomic_flag crashed = ATOMIC_FLAG_INIT;

void tell_and_crash(int number) {
  // Of several threads the first one tells.
  while (crashed.test_and_set()) ::pause();
  SignalSafeLine line;
  line << "nullmark: crashed (signal " << number << ")";
  if (const char* cell = InFlight::cell()) line << " in cell " << cell;
  if (library_is_loaded()) line << "; if a tracker's library is the cause, \"isolate\": true runs it in a process of its own";
  if (InFlight::cell())
    line << "; `run` keeps finished cells beside the results, in *.journal, and --resume continues from there";
  line.write();
  ::signal(number, SIG_DFL);
  ::raise(number);
}

}  // namespace

void open_closed_descriptors() {
  for (int file = STDIN_FILENO; file <= STDERR_FILENO; ++file) {
    if (::fcntl(file, F_GETFD) >= 0) continue;
    // The lowest closed descriptor is the one that `open` gives.
    if (::open("/dev/null", file == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

void return_freed_memory() {
#if defined(__GLIBC__)
  // By themselves these grow with the largest block that was freed.  The memory of cells then lies between the records that stay.
  // With lower thresholds each cell fetches its pages anew: at 64 kB and 1 MB the sweep took 1.5 times the CPU time.
  ::mallopt(M_MMAP_THRESHOLD, 1 << 22);
  ::mallopt(M_TRIM_THRESHOLD, 1 << 24);
#endif
}

void report_files_that_grow_too_large() { ::signal(SIGXFSZ, SIG_IGN); }

void tell_of_crashes() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // Sanitizers tell more.
  static const std::string nothing;
  const InFlight alternate_stack(nothing);
  struct sigaction action = {};
  action.sa_handler = tell_and_crash;
  action.sa_flags = SA_ONSTACK;
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(number, &action, nullptr);
#endif
}

void expect_threads(int wanted) {
  // One of TBB's is there already; others write the journal and watch the clock.
  const int count = 1 + (wanted > 0 ? wanted : static_cast<int>(std::thread::hardware_concurrency()));
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::vector<std::thread> threads;
  std::string error;
  try {
    for (int i = 0; i < count; ++i)
      threads.emplace_back([&] {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return done; });
      });
  } catch (const std::system_error& refused) {
    error = refused.code().message();
  }
  const std::size_t started = threads.size();
  {
    const std::lock_guard lock(mutex);
    done = true;
  }
  changed.notify_all();
  for (std::thread& thread : threads) thread.join();
  if (!error.empty())
    throw InputError(fmt::format("{} of {} threads cannot be started: {}; give fewer --threads, or raise the limit (ulimit -u)",
                                 static_cast<std::size_t>(count) - started, count, error));
}

}  // namespace nullmark
