#pragma once

namespace nullmark {

/// The word by which this executable, started as `PROGRAM WORD LIBRARY NAME`, becomes the process of an isolated library instead
/// of the program.
inline constexpr const char* kServeLibrary = "nullmark:serve-library";

}  // namespace nullmark
