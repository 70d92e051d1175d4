// Preloaded into the program by process_test.cpp: no thread can be started from the one on whose number is FAULTY_THREADS,
// from 1.

#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) {
  static auto* const real = reinterpret_cast<decltype(&::pthread_create)>(::dlsym(RTLD_NEXT, "pthread_create"));
  static std::atomic<int> started{0};
  const char* const first = std::getenv("FAULTY_THREADS");
  if (first && ++started >= std::atoi(first)) return EAGAIN;
  return real(thread, attributes, run, argument);
}
