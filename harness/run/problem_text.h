#pragma once

#include <string>

namespace nullmark {

/// README.md of a problem.
std::string problem_readme(const std::string& name, bool answers);

}  // namespace nullmark
