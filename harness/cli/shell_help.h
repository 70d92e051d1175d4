#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace nullmark {

/// The shells that `completion_script` knows.
const std::vector<std::string>& completed_shells();

/// A script that completes the commands, options and file names of a program in a shell.
std::string completion_script(const CLI::App& program, const std::string& shell);

/// The program's page for `man`, section 1, as troff source.
std::string manual_page(const CLI::App& program, const std::string& version);

}  // namespace nullmark
