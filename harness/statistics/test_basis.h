#pragma once

#include <cstdint>

namespace nullmark {

/// What the evidence of a test is made of.  `both`: betting and Catoni's bounds.  `none`: nothing could be bet.  `counted`: lookups,
/// where the harness draws the flights (harness/verdict/counted_lookups.h).
enum class TestBasis : std::uint8_t { betting, catoni, both, deterministic, none, counted };

}  // namespace nullmark
