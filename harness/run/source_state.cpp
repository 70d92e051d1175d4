#include "harness/run/source_state.h"

#include "commit.h"

namespace nullmark {

SourceState source_state() { return {NULLMARK_GIT_COMMIT, NULLMARK_CHANGES, NULLMARK_GIT_DIRTY != 0, NULLMARK_COMPILER_FLAGS}; }

}  // namespace nullmark
