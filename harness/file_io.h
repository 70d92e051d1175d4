#pragma once

#include <string>

namespace nullmark {

/// The whole file.  Throws InputError where it cannot be read.
std::string read_file(const std::string& path);

/// Puts the text in the file's place at once: whoever opens the path sees the old file or the new one, complete, even after a
/// power cut.  Throws InputError where the path cannot be written.
void write_atomically(const std::string& path, const std::string& text);

/// Writes all of it to an open file and has it reach the disk.  Throws InputError.
void write_durably(int file, const std::string& text, const std::string& path);

}  // namespace nullmark
