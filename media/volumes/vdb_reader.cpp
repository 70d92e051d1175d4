#include "media/volumes/vdb_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "media/base/own_executable.h"
#include "media/base/registry.h"
#include "media/volumes/flat_volume.h"
#include "media/volumes/machine_memory.h"
#include "media/volumes/vdb_process.h"

// Damaged files crash OpenVDB or have it loop, so a process of their own reads them.  It is this executable over again, whatever
// that is - the program, a plug-in, tests, benchmarks - with words that no command line has: an initialiser in this file answers
// them before main() begins, so that wherever read_vdb is linked, so is its other half, without a hook in anybody's main() and
// without a second executable to be installed and found.  A fork alone would not do: other threads may hold OpenVDB's or TBB's
// locks.

namespace nullmark {
namespace {

constexpr const char* kCommand = "nullmark:read-volume";
/// Where the reader finds the file it answers into.
constexpr int kAnswer = 3;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

struct Limits {
  std::uint64_t cpu_seconds, wall_seconds, bytes;
};

/// A megabyte takes a hundredth of a second on a machine of today.  A tree in memory is at most 33 times its file: the sparsest
/// nodes have two bits of masks in the file for every eight bytes of memory.
Limits limits_of(std::uint64_t file_size) {
  const std::uint64_t cpu = 3 + file_size / 1'000'000;
  const std::uint64_t machine = machine_memory();
  constexpr std::uint64_t kLeast = std::uint64_t{1} << 30;
  return {cpu, 60 + 10 * cpu, std::min(machine, kLeast + 64 * std::min(file_size, machine))};
}

void limit(decltype(RLIMIT_CPU) resource, std::uint64_t value) {
  rlimit now{};
  ::getrlimit(resource, &now);
  now.rlim_cur = std::min<rlim_t>(value, now.rlim_max);
  ::setrlimit(resource, &now);
}

/// Address space in use, in bytes.
std::uint64_t mapped() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::getpagesize());
}

std::uint64_t number(const char* text) {
  std::uint64_t value = 0;
  std::from_chars(text, text + std::strlen(text), value);
  return value;
}

[[noreturn]] void serve(const char* file, const char* grid, const Limits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds);
  ::alarm(static_cast<unsigned>(limits.wall_seconds));
  // Sanitizers map terabytes of their own.
  if (!kSanitized) limit(RLIMIT_AS, mapped() + limits.bytes);
  ::_exit(answer_volume(file, grid, kAnswer) ? 0 : 1);
}

/// The C library hands initialisers what it hands main().
[[gnu::constructor]] void serve_if_asked(int argc, char** argv, char**) {
  if (argc == 7 && std::string_view(argv[1]) == kCommand)
    serve(argv[2], argv[3], {number(argv[4]), number(argv[5]), number(argv[6])});
}

/// Memory that another process fills as a file; read-only here.
class Answer {
 public:
  Answer() : file_(::memfd_create("nullmark-volume", MFD_CLOEXEC)) {}
  ~Answer() {
    if (data_) ::munmap(data_, size_);
    if (file_ >= 0) ::close(file_);
  }
  Answer(const Answer&) = delete;
  Answer& operator=(const Answer&) = delete;

  int file() const { return file_; }

  /// To be called once nobody writes any more.
  std::span<const std::byte> bytes() {
    struct stat status {};
    if (::fstat(file_, &status) != 0 || status.st_size == 0) return {};
    size_ = static_cast<std::size_t>(status.st_size);
    void* const data = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file_, 0);
    if (data == MAP_FAILED) throw std::bad_alloc();
    data_ = data;
    return {static_cast<const std::byte*>(data_), size_};
  }

 private:
  int file_;
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

/// The error number of the start, or 0 and how the process ended.
int run_reader(const std::string& file, const std::string& grid, const Limits& limits, int answer, int& status) {
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, answer, kAnswer);
  // What libraries print when they give up would stand between this program's lines.
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);

  // The limits work by signals; what asks the parent to end is for the parent alone.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t blocked, defaults;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGINT);
  sigaddset(&blocked, SIGTERM);
  sigemptyset(&defaults);
  for (const int signal : {SIGXCPU, SIGALRM, SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) sigaddset(&defaults, signal);
  ::posix_spawnattr_setsigmask(&attributes, &blocked);
  ::posix_spawnattr_setsigdefault(&attributes, &defaults);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  const std::string path = own_executable();
  std::array<std::string, 7> words{path,
                                   kCommand,
                                   file,
                                   grid,
                                   std::to_string(limits.cpu_seconds),
                                   std::to_string(limits.wall_seconds),
                                   std::to_string(limits.bytes)};
  std::array<char*, 8> arguments{};
  std::transform(words.begin(), words.end(), arguments.begin(), [](std::string& word) { return word.data(); });
  pid_t child = 0;
  const int error = ::posix_spawn(&child, path.c_str(), &files, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  if (error != 0) return error;
  // Where nobody keeps children's ends (SIGCHLD ignored) the answer alone has to tell.
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return 0;
}

/// Why there is no answer; empty where there is one.
std::string failure(int status, const Limits& limits) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU)
      return fmt::format("the OpenVDB reader worked on it for {} s without an end; the file is damaged, copy it again",
                         limits.cpu_seconds);
    if (signal == SIGALRM)
      return fmt::format("the OpenVDB reader did not finish in {} s; copy the file to a faster disk, or copy it again",
                         limits.wall_seconds);
    if (signal == SIGKILL)
      return "the OpenVDB reader was killed (signal 9), perhaps for want of memory; free some, or resample the grid";
    return fmt::format("the OpenVDB reader crashed on it (signal {}, {}); the file is damaged, copy it again", signal,
                       ::strsignal(signal));
  }
  if (WEXITSTATUS(status) != 0)
    return "the OpenVDB reader could not hand over what it read, perhaps for want of memory; free some";
  return "";
}

}  // namespace

VolumeData read_vdb(const std::string& file, const std::string& grid) {
  if (file.empty()) throw ParameterError("file", "no file given; expected the path of an OpenVDB file");
  const auto refuse = [&](const std::string& message) {
    throw ParameterError("file", fmt::format("{}: grid \"{}\": {}", file, grid, message));
  };
  std::error_code error;
  const std::filesystem::file_status found = std::filesystem::status(file, error);
  if (!std::filesystem::exists(found))
    throw MissingData(fmt::format("{}: no such file{} (grid \"{}\"); `nullmark make-volume {}` writes a procedural one", file,
                                  std::filesystem::path(file).is_relative() ? " in the current folder" : "", grid, file));
  // A pipe or a device would keep its reader waiting.
  if (!std::filesystem::is_regular_file(found)) refuse("not a regular file; expected the path of an OpenVDB file");
  if (::access(file.c_str(), R_OK) != 0)
    refuse(fmt::format("cannot be read: {}; expected a file that you may read", std::strerror(errno)));
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error) refuse(error.message());

  const Limits limits = limits_of(size);
  Answer answer;
  if (answer.file() < 0) refuse(fmt::format("no memory to read it into: {}", std::strerror(errno)));
  int status = 0;
  if (const int number = run_reader(file, grid, limits, answer.file(), status))
    refuse(fmt::format("its reader, this program again, cannot be started: {}; is /proc mounted?", std::strerror(number)));
  if (const std::string why = failure(status, limits); !why.empty()) refuse(why);
  return unflatten(answer.bytes(), file, grid);
}

}  // namespace nullmark
