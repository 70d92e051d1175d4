#pragma once

#include <string>

namespace nullmark {

/// ${NULLMARK_...} replaced by the environment variable's value.  Throws MissingData for a variable that is not set.
std::string with_variables(std::string text);

}  // namespace nullmark
