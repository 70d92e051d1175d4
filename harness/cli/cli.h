#pragma once

namespace nullmark {

/// The program: parses the command line and carries out the command.  Returns the process's exit code; never throws.
int nullmark_main(int argc, char** argv);

}  // namespace nullmark
