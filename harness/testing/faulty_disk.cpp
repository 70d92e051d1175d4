// Preloaded into the program by kill_test.cpp: counts what it does to files of one folder and fails at one of these steps.
//   FAULTY_DISK_FOLDER  the folder
//   FAULTY_DISK         "kill N": dies before step N;  "tear N": dies in step N, a write half done;  "full N": from the N-th
//   write
//                       on the disk is full, which half of that write still fits on

#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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

bool watched(int file) {
  char path[4096];
  const ssize_t length = ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
  return length > 0 && watched(std::string(path, static_cast<std::size_t>(length)));
}

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

}  // namespace

extern "C" {

ssize_t write(int file, const void* data, std::size_t size) {
  static auto* const real = next<decltype(::write)>("write");
  if (!watched(file)) return real(file, data, size);
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
  if (watched(file) && torn()) die();
  return real(file);
}

int ftruncate(int file, off_t size) noexcept {
  static auto* const real = next<int(int, off_t)>("ftruncate");
  const bool die_after = watched(file) && torn();
  const int result = real(file, size);
  if (die_after) die();
  return result;
}

int rename(const char* from, const char* to) noexcept {
  static auto* const real = next<int(const char*, const char*)>("rename");
  const bool die_after = watched_path(to) && torn();
  const int result = real(from, to);
  if (die_after) die();
  return result;
}

int unlink(const char* path) noexcept {
  static auto* const real = next<int(const char*)>("unlink");
  const bool die_after = watched_path(path) && torn();
  const int result = real(path);
  if (die_after) die();
  return result;
}
}
