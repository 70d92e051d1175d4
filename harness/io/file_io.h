#pragma once

#include <string>

namespace nullmark {

/// The whole file, unpacked where gzip has packed it.  Throws InputError where it cannot be read, or unpacks to more than 1 GiB.
std::string read_file(const std::string& path);

/// Puts the text in the file's place at once: whoever opens the path sees the old file or the new one, complete, even after a
/// power cut.  Throws InputError where the path cannot be written.
void write_atomically(const std::string& path, const std::string& text);

/// Throws InputError where a folder, a device or a pipe stands at the path: a file put in its place would be the end of it.
void expect_replaceable(const std::string& path);

/// Removes what processes that were killed in `write_atomically` of this path have left beside it.
void remove_leftovers(const std::string& path);

/// Writes all of it to an open file and has it reach the disk.  Throws InputError.
void write_durably(int file, const std::string& text, const std::string& path);

}  // namespace nullmark
