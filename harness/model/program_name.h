#pragma once

#include <string>

namespace nullmark {

/// The name that this program was called by, without its folder: "nullmark", or that of a plug-in.  For commands in texts.
inline std::string& program_name() {
  static std::string name = "nullmark";
  return name;
}

}  // namespace nullmark
