#pragma once

#include <string>

#include "harness/io/text.h"

namespace nullmark {

/// A word of a command as people type it: quoted only where a shell would read something else.
inline std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_of(" \t\n'\"$`\\&|;<>()*?[]{}#~!") == std::string::npos;
  return plain ? word : shell_quoted(word);
}

}  // namespace nullmark
