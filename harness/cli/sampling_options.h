#pragma once

#include "harness/cli/commands.h"

namespace CLI {
class App;
}

namespace nullmark {

/// What `--builds` means, of `run` and of `merge`.
inline constexpr const char* kBuilds =
    "any: also join cells of the same source by another compiler, C library or instruction set, and mark them; default same";

/// Declare the options of the commands that draw samples, and where what is asked goes.
void declare_run(CLI::App& command, RunCommand& asked);
void declare_prove(CLI::App& command, ProveCommand& asked);
void declare_problem(CLI::App& command, ProblemCommand& asked);
void declare_judge(CLI::App& command, JudgeCommand& asked);
void declare_replay(CLI::App& command, ReplayCommand& asked);

}  // namespace nullmark
