#pragma once

#include <cstdint>
#include <string>

namespace nullmark {

/// FNV-1a of a file's bytes; 0 where it cannot be read.  Tells builds of a tracker apart; not for hostile input.
std::uint64_t content_hash(const std::string& path);

}  // namespace nullmark
