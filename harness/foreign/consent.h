#pragma once

#include <string>

namespace nullmark {

/// Lets configurations run code from outside of nullmark, for the rest of the process.  Commands that draw samples call it if
/// their user said so; commands that read results never do.
void allow_foreign_code();

/// allow_foreign_code() if the option was given or NULLMARK_ALLOW_FOREIGN is 1.
void take_consent(bool option);

/// Throws ParameterError unless foreign code is allowed.  `what` names it: "library ./libmine.so".
void expect_foreign_code_allowed(const std::string& what);

}  // namespace nullmark
