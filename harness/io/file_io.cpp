#include "harness/io/file_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/file_descriptor.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <boost/iostreams/stream.hpp>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "harness/io/json_input.h"

namespace nullmark {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const std::string& path, const char* action) {
  throw InputError(
      fmt::format("{}: cannot be {}: {}; give a path in an existing, writable folder", path, action, std::strerror(errno)));
}

constexpr const char* kTemporary = ".tmp";

/// Where the path leads: links to results stay links.
fs::path target_of(const std::string& path) {
  std::error_code error;
  const fs::path target = fs::canonical(path, error);
  return error ? fs::path(path) : target;
}

constexpr std::size_t kMebi = std::size_t{1} << 20;

/// Calls visit(part) for all of a packed text.
template <class Visit>
void unpack(const std::string& packed, const std::string& path, const Visit& visit) {
  namespace io = boost::iostreams;
  io::filtering_istream stream;
  stream.push(io::gzip_decompressor());
  stream.push(io::array_source(packed.data(), packed.size()));
  // Otherwise what is damaged would only look shorter.
  stream.exceptions(std::ios::badbit);
  std::vector<char> part(kMebi);
  try {
    while (stream.read(part.data(), static_cast<std::streamsize>(part.size())) || stream.gcount() > 0)
      visit(std::string_view(part.data(), static_cast<std::size_t>(stream.gcount())));
  } catch (const io::gzip_error&) {
    throw InputError(path + ": is a damaged gzip file; copy it again");
  } catch (const std::ios_base::failure&) {
    throw InputError(path + ": is a damaged gzip file; copy it again");
  }
}

/// Where a text of so many bytes is more than is read.
void expect_at_most(std::size_t size, std::size_t most, const std::string& path, const char* does) {
  if (size <= most * kMebi) return;
  const std::string largest = most < 1024 ? fmt::format("{} MiB", most) : fmt::format("{} GiB", most / 1024);
  throw InputError(fmt::format("{}: {} more than {}; expected a {}", path, does, largest,
                               most < kLargestResults ? "configuration" : "configuration or results"));
}

std::string unpacked(const std::string& packed, const std::string& path, std::size_t most) {
  // Its size first: a small file may unpack to more than the machine's memory.
  std::size_t size = 0;
  unpack(packed, path, [&](std::string_view part) {
    size += part.size();
    expect_at_most(size, most, path, "unpacks to");
  });
  std::string text;
  text.reserve(size);
  unpack(packed, path, [&](std::string_view part) { text += part; });
  return text;
}

}  // namespace

std::string read_stream(std::istream& in, const std::string& path, std::size_t most) {
  // Some devices never end.
  constexpr std::size_t kMostOfDevice = std::size_t{1} << 24;
  std::error_code error;
  const bool device = fs::is_character_file(path, error);
  std::string text;
  // A text that grows takes twice its size.
  if (const auto size = fs::file_size(path, error); !error && size <= most * kMebi) text.reserve(size);
  std::vector<char> part(kMebi);
  while (in.read(part.data(), static_cast<std::streamsize>(part.size())) || in.gcount() > 0) {
    text.append(part.data(), static_cast<std::size_t>(in.gcount()));
    if (device && text.size() > kMostOfDevice) throw InputError(path + ": does not end; expected a file");
    expect_at_most(text.size(), most, path, "holds");
  }
  return text;
}

std::string read_file(const std::string& path, std::size_t most) {
  std::error_code error;
  if (fs::is_directory(path, error)) throw InputError(path + ": is a folder; expected a file");
  if (fs::is_regular_file(path, error)) expect_at_most(fs::file_size(path, error), most, path, "holds");
  // Nobody may ever write to a pipe that has a name: one that waits for no writer ends at once.
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const int reason = errno;
  if (file < 0 || ::fcntl(file, F_SETFL, 0) != 0)
    throw InputError(reason == ENOENT ? path + ": no such file"
                                      : fmt::format("{}: cannot be read: {}; expected a file", path, std::strerror(reason)));
  boost::iostreams::stream<boost::iostreams::file_descriptor_source> in(file, boost::iostreams::close_handle);
  std::string text = read_stream(in, path, most);
  return text.rfind("\x1f\x8b", 0) == 0 ? unpacked(text, path, most) : text;
}

void write_all(int file, std::string_view text, const std::string& path) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::write(file, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path, "written");
    done += static_cast<std::size_t>(written);
  }
}

void make_durable(int file, const std::string& path) {
  // Pipes and devices know no fsync.
  if (::fsync(file) != 0 && errno != EINVAL && errno != EROFS) fail(path, "written");
}

void make_name_durable(const std::string& path) {
  const fs::path directory = fs::path(path).parent_path();
  const int file = ::open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

void write_atomically(const std::string& path, const std::string& text) {
  write_atomically(path, [&](const TextSink& to) { to(text); });
}

void write_atomically(const std::string& path, const std::function<void(const TextSink&)>& write) {
  expect_replaceable(path);
  const fs::path target = target_of(path);
  const std::string temporary = fmt::format("{}.{}{}", target.string(), ::getpid(), kTemporary);
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail(path, "written");
  try {
    constexpr std::size_t kMostWaiting = kMebi;
    std::string waiting;
    write([&](std::string_view part) {
      waiting += part;
      if (waiting.size() < kMostWaiting) return;
      write_all(file, waiting, path);
      waiting.clear();
    });
    write_all(file, waiting, path);
    make_durable(file, path);
  } catch (...) {
    ::close(file);
    ::unlink(temporary.c_str());
    throw;
  }
  ::close(file);
  if (std::rename(temporary.c_str(), target.c_str()) != 0) {
    ::unlink(temporary.c_str());
    fail(path, "written");
  }
  make_name_durable(target.string());
}

void expect_replaceable(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::none)
    throw InputError(fmt::format("{}: cannot be written: {}; give another path", path, error.message()));
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw InputError(path + ": is not a regular file; expected the path of a file, or - for standard output");
}

void expect_plain_or_none(const std::string& path) {
  expect_replaceable(path);
  if (fs::is_symlink(path)) throw InputError(path + ": is a link; give the path of the file");
}

void remove_leftovers(const std::string& path) {
  const fs::path target = target_of(path);
  const std::string prefix = target.filename().string() + ".";
  std::error_code error;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(target.has_parent_path() ? target.parent_path() : fs::path("."), error)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(prefix, 0) != 0 || entry.path().extension() != kTemporary) continue;
    pid_t owner = 0;
    const char* const end = name.data() + name.size() - std::strlen(kTemporary);
    if (std::from_chars(name.data() + prefix.size(), end, owner).ptr != end || owner <= 0) continue;
    if (::kill(owner, 0) != 0 && errno == ESRCH) fs::remove(entry.path(), error);
  }
}

}  // namespace nullmark
