#include "harness/foreign/consent.h"

#include <fmt/format.h>

#include <atomic>
#include <cstdlib>
#include <string_view>

#include "media/base/parameters.h"

namespace nullmark {
namespace {

std::atomic<bool> allowed = false;

}  // namespace

void allow_foreign_code() { allowed = true; }

void take_consent(bool option) {
  const char* const variable = std::getenv("NULLMARK_ALLOW_FOREIGN");
  if (option || (variable && std::string_view(variable) == "1")) allow_foreign_code();
}

void expect_foreign_code_allowed(const std::string& what) {
  if (allowed) return;
  throw ParameterError("",
                       fmt::format("{} is code from outside of nullmark, which runs with all your rights; if you trust it, give "
                                   "--allow-foreign or set NULLMARK_ALLOW_FOREIGN=1",
                                   what));
}

}  // namespace nullmark
