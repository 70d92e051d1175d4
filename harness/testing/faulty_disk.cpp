// Preloaded into the program by tests: counts what it does to files of one folder, and fails at one of these steps or tells them.
//   FAULTY_DISK_FOLDER  the folder
//   FAULTY_DISK         "kill N": dies before step N
//                       "tear N": dies in step N, a write half done
//                       "full N": from the N-th write on the disk is full; half of that write still fits on it
//                       "log 0": steps are told in the file FAULTY_DISK_LOG, in the words of power_cut.h

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace {

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

struct Plan {
  char action[8] = "";
  int step = 0;
  Plan() {
    const char* const text = std::getenv("FAULTY_DISK");
    if (text) std::sscanf(text, "%7s %d", action, &step);
  }
  bool is(const char* name) const { return std::strcmp(action, name) == 0; }
};

const Plan& plan() {
  static const Plan plan;
  return plan;
}

bool watched(const std::string& path) {
  const char* const folder = std::getenv("FAULTY_DISK_FOLDER");
  return folder && path.rfind(folder, 0) == 0;
}

std::string path_of(int file) {
  char path[4096];
  const ssize_t length = ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
  return length > 0 ? std::string(path, static_cast<std::size_t>(length)) : "";
}

bool watched(int file) { return watched(path_of(file)); }

/// Paths of the program may be relative to the folder, where the tests run it.
bool watched_path(const char* path) { return path[0] == '/' ? watched(std::string(path)) : true; }

[[noreturn]] void die() {
  ::kill(::getpid(), SIGKILL);
  for (;;) ::pause();
}

std::atomic<int> steps{0}, writes{0};

/// Whether to die in this step, having done part of it.
bool torn() {
  const int step = ++steps;
  if (plan().is("kill") && step == plan().step) die();
  return plan().is("tear") && step == plan().step;
}

std::string name_of(const std::string& path) { return path.substr(path.rfind('/') + 1); }

/// Tells a step, its words without spaces.
void tell(const std::string& step) {
  static const int log = ::open(std::getenv("FAULTY_DISK_LOG"), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const std::string line = step + "\n";
  if (::syscall(SYS_write, log, line.data(), line.size()) < 0) ::abort();
}

std::string hexadecimal(const void* data, std::size_t size) {
  std::string text;
  for (std::size_t i = 0; i < size; ++i) {
    const unsigned char byte = static_cast<const unsigned char*>(data)[i];
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

/// Steps are told in the order in which they are taken.
std::unique_lock<std::mutex> in_order() {
  static std::mutex mutex;
  return plan().is("log") ? std::unique_lock(mutex) : std::unique_lock<std::mutex>();
}

off_t place_of_next_write(int file) {
  struct stat now {};
  if (!(::fcntl(file, F_GETFL) & O_APPEND)) return ::lseek(file, 0, SEEK_CUR);
  return ::fstat(file, &now) == 0 ? now.st_size : 0;
}

}  // namespace

extern "C" {

ssize_t write(int file, const void* data, std::size_t size) {
  static auto* const real = next<decltype(::write)>("write");
  if (!watched(file)) return real(file, data, size);
  if (const auto lock = in_order()) {
    const off_t place = place_of_next_write(file);
    const ssize_t written = real(file, data, size);
    if (written > 0)
      tell("write " + name_of(path_of(file)) + " " + std::to_string(place) + " " +
           hexadecimal(data, static_cast<std::size_t>(written)));
    return written;
  }
  if (torn()) {
    real(file, data, size / 2);
    die();
  }
  const int number = ++writes;
  if (!plan().is("full") || number < plan().step) return real(file, data, size);
  if (number == plan().step && size > 1) return real(file, data, size / 2);
  errno = ENOSPC;
  return -1;
}

int fsync(int file) {
  static auto* const real = next<decltype(::fsync)>("fsync");
  const auto lock = in_order();
  if (watched(file) && torn()) die();
  const int result = real(file);
  if (struct stat status; result == 0 && lock && watched(file) && ::fstat(file, &status) == 0)
    tell(S_ISDIR(status.st_mode) ? "sync_folder" : "sync " + name_of(path_of(file)));
  return result;
}

int ftruncate(int file, off_t size) noexcept {
  static auto* const real = next<int(int, off_t)>("ftruncate");
  const auto lock = in_order();
  const bool die_after = watched(file) && torn();
  const int result = real(file, size);
  if (die_after) die();
  if (lock && result == 0 && watched(file)) tell("truncate " + name_of(path_of(file)) + " " + std::to_string(size));
  return result;
}

int rename(const char* from, const char* to) noexcept {
  static auto* const real = next<int(const char*, const char*)>("rename");
  const auto lock = in_order();
  const bool die_after = watched_path(to) && torn();
  const int result = real(from, to);
  if (die_after) die();
  if (lock && result == 0 && watched_path(to)) tell("rename " + name_of(from) + " " + name_of(to));
  return result;
}

int unlink(const char* path) noexcept {
  static auto* const real = next<int(const char*)>("unlink");
  const auto lock = in_order();
  const bool die_after = watched_path(path) && torn();
  const int result = real(path);
  if (die_after) die();
  if (lock && result == 0 && watched_path(path)) tell("unlink " + name_of(path));
  return result;
}
}
