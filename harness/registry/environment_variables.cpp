#include "harness/registry/environment_variables.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

#include "media/base/registry.h"

namespace nullmark {

std::string with_variables(std::string text) {
  constexpr std::string_view kOpening = "${NULLMARK_";
  for (std::size_t at = 0; (at = text.find(kOpening, at)) != std::string::npos;) {
    const std::size_t end = text.find('}', at);
    if (end == std::string::npos) break;
    const std::string variable = text.substr(at + 2, end - at - 2);
    const char* value = std::getenv(variable.c_str());
    if (!value) throw MissingData(fmt::format("environment variable {} is not set, needed by \"{}\"", variable, text));
    text.replace(at, end + 1 - at, value);
    at += std::string_view(value).size();
  }
  return text;
}

}  // namespace nullmark
