// Compiled for every CPU of the architecture (harness/CMakeLists.txt), and run before anything else of the program: on a CPU that
// lacks its instructions, the first of them would end it without a word.
#include "harness/cli/cpu_features.h"

#if defined(__x86_64__)
#include <unistd.h>

#include <cstring>

#include "harness/model/exit_code.h"
#endif

namespace nullmark {

#if defined(__x86_64__)

namespace {

// No library may be asked: none is initialised yet.
[[noreturn]] void refuse(const char* name) {
  char line[160] = "nullmark: this CPU lacks ";
  std::strcat(std::strcat(line, name),
              ", which this program was built for; build it on this machine, or with -DNULLMARK_ARCH=x86-64\n");
  if (write(STDERR_FILENO, line, std::strlen(line)) < 0) {
    // The exit code says it.
  }
  _exit(static_cast<int>(ExitCode::input_error));
}

// 101: before the constructors of objects.
[[gnu::constructor(101)]] void check_this_cpu() { check_cpu(kNeededFeatures); }

}  // namespace

void check_cpu(const bool needed[]) {
  __builtin_cpu_init();
#define NULLMARK_CHECK(name, macro) \
  if (*needed++ && !__builtin_cpu_supports(name)) refuse(name);
  NULLMARK_CPU_FEATURES(NULLMARK_CHECK)
}

#else

void check_cpu(const bool[]) {}

#endif

}  // namespace nullmark
