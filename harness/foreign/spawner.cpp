#include "harness/foreign/spawner.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <thread>

namespace nullmark {
namespace {

/// Between fork and exec: only calls that are safe there.
[[noreturn]] void become(const SpawnRequest& request, char* const* arguments, int report, pid_t parent) {
  const auto give_up = [&] {
    const int error = errno;
    [[maybe_unused]] const ssize_t written = ::write(report, &error, sizeof error);
    ::_exit(127);
  };
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  ::setpgid(0, 0);
  if (!request.folder.empty() && ::chdir(request.folder.c_str()) != 0) give_up();
  // Out of the way of the numbers that they take below.
  const auto above = [&](int file) { return file < 0 ? -1 : ::fcntl(file, F_DUPFD_CLOEXEC, 10); };
  const int input = above(request.input), output = above(request.output), errors = above(request.errors),
            memory = above(request.memory);
  report = above(report);
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(errors, STDERR_FILENO);
  if (memory >= 0) ::dup2(memory, 3);
  rlimit limit{0, 0};
  ::setrlimit(RLIMIT_CORE, &limit);
  if (request.bytes > 0) {
    limit = {static_cast<rlim_t>(request.bytes), static_cast<rlim_t>(request.bytes)};
    ::setrlimit(RLIMIT_AS, &limit);
  }
  struct sigaction standard = {};
  standard.sa_handler = SIG_DFL;
  for (int signal = 1; signal < 32; ++signal) ::sigaction(signal, &standard, nullptr);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::execvp(arguments[0], arguments);
  give_up();
  __builtin_unreachable();
}

SpawnResult fork_and_exec(const SpawnRequest& request) {
  std::vector<char*> arguments;
  for (const std::string& word : request.command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  int report[2];
  if (::pipe2(report, O_CLOEXEC) != 0) return {-1, errno};
  SpawnResult result;
  const pid_t parent = ::getpid();
  result.process = ::fork();
  if (result.process == 0) become(request, arguments.data(), report[1], parent);
  if (result.process < 0) result.error = errno;
  ::close(report[1]);
  // Closed by exec: nothing to read is success.
  if (result.process > 0) {
    ssize_t n = 0;
    while ((n = ::read(report[0], &result.error, sizeof result.error)) < 0 && errno == EINTR) {
    }
    if (n > 0) ::waitpid(result.process, nullptr, 0);
  }
  ::close(report[0]);
  return result;
}

/// The thread that starts processes.
class Spawner {
 public:
  static Spawner& instance() {
    // Never destroyed: it must outlive whatever still holds a process.
    static Spawner* const spawner = new Spawner;
    return *spawner;
  }

  SpawnResult operator()(const SpawnRequest& request) {
    const std::lock_guard one(callers_);
    std::unique_lock lock(mutex_);
    request_ = &request;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !request_; });
    return result_;
  }

 private:
  Spawner() {
    std::thread([this] {
      sigset_t all;
      sigfillset(&all);
      ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
      std::unique_lock lock(mutex_);
      for (;;) {
        changed_.wait(lock, [&] { return request_ != nullptr; });
        result_ = fork_and_exec(*request_);
        request_ = nullptr;
        changed_.notify_all();
      }
    }).detach();
  }

  std::mutex callers_, mutex_;
  std::condition_variable changed_;
  const SpawnRequest* request_ = nullptr;
  SpawnResult result_;
};

}  // namespace

SpawnResult spawn(const SpawnRequest& request) { return Spawner::instance()(request); }

}  // namespace nullmark
