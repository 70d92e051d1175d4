// Compiled as all of the program is; data alone, for none of its code may run before the CPU is checked.
#include "harness/cli/cpu_features.h"

namespace nullmark {

// A macro that is not defined stays its own name.
#define NULLMARK_TEXT(macro) #macro
#define NULLMARK_NEEDED(name, macro) NULLMARK_TEXT(macro)[0] == '1',
constinit const bool kNeededFeatures[] = {NULLMARK_CPU_FEATURES(NULLMARK_NEEDED) false};

}  // namespace nullmark
