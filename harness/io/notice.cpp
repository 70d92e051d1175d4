#include "harness/io/notice.h"

#include <cstdio>

namespace nullmark {

void write_notice(std::string_view text) noexcept {
  // Tables that stand in the buffer of standard output come first where both go to one file.
  (void)std::fflush(stdout);
  // Unbuffered: a line is one write, and what could not be written leaves nothing behind.
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
  std::clearerr(stderr);
}

}  // namespace nullmark
