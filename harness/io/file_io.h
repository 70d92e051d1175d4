#pragma once

#include <functional>
#include <istream>
#include <string>
#include <string_view>

namespace nullmark {

/// The largest text that is read, packed or not, in MiB: of results, and of a configuration.
inline constexpr std::size_t kLargestResults = 1024, kLargestConfig = 64;

/// What is left of a stream; `path` names it.  Throws InputError beyond `most` MiB, and of a device beyond 16 MiB.
std::string read_stream(std::istream& in, const std::string& path, std::size_t most = kLargestResults);

/// Reads the whole file, and unpacks gzip.  Throws InputError if it cannot be read, or holds or unpacks to more than `most` MiB.
std::string read_file(const std::string& path, std::size_t most = kLargestResults);

/// Takes a text part by part.
using TextSink = std::function<void(std::string_view)>;

/// Replaces the file atomically: readers see the complete old file or the complete new one, even after a power cut.  Throws
/// InputError if the path cannot be written.
void write_atomically(const std::string& path, const std::string& text);
/// The same of a text that `write` tells part by part, so that it need not be held as a whole.
void write_atomically(const std::string& path, const std::function<void(const TextSink&)>& write);

/// Throws InputError if the path is a folder, a device or a pipe, which a file would replace.
void expect_replaceable(const std::string& path);

/// The same, and of links, for what other libraries write, who would write through them.
void expect_plain_or_none(const std::string& path);

/// Removes temporary files that processes left when they were killed in `write_atomically` of this path.
void remove_leftovers(const std::string& path);

/// Writes the whole text to an open file, from where a power cut can still lose it.  Throws InputError.
void write_all(int file, std::string_view text, const std::string& path);

/// Puts on disk what was written to an open file.  Throws InputError.
void make_durable(int file, const std::string& path);

/// Syncs the folder of the path: only then does a new or renamed file survive a power cut.  Errors are ignored.
void make_name_durable(const std::string& path);

}  // namespace nullmark
