#include "harness/io/notice.h"

#include <cstdio>

namespace nullmark {

void write_notice(std::string_view text) noexcept {
  // Unbuffered: a line is one write, and what could not be written leaves nothing behind.
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
  std::clearerr(stderr);
}

}  // namespace nullmark
