#pragma once

#include "harness/model/exit_code.h"

namespace nullmark {

/// Parses the words of the command line and carries out the command.  Throws InputError for wrong words, and what the command
/// throws.
ExitCode execute_command_line(int argc, char** argv);

}  // namespace nullmark
