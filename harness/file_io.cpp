#include "harness/file_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "harness/json_input.h"

namespace nullmark {
namespace {

[[noreturn]] void fail(const std::string& path, const char* action) {
  throw InputError(fmt::format("{}: cannot be {}: {}; give a path in a folder that is there and can be written", path, action,
                               std::strerror(errno)));
}

/// A renamed file survives a power cut only once its directory has reached the disk.
void sync_directory(const std::filesystem::path& directory) {
  const int file = ::open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

}  // namespace

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path)) throw InputError(path + ": cannot be read; expected a file");
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_durably(int file, const std::string& text, const std::string& path) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::write(file, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path, "written");
    done += static_cast<std::size_t>(written);
  }
  // Pipes and devices know no fsync.
  if (::fsync(file) != 0 && errno != EINVAL && errno != EROFS) fail(path, "written");
}

void write_atomically(const std::string& path, const std::string& text) {
  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail(path, "written");
  try {
    write_durably(file, text, path);
  } catch (...) {
    ::close(file);
    ::unlink(temporary.c_str());
    throw;
  }
  ::close(file);
  if (std::rename(temporary.c_str(), path.c_str()) != 0) {
    ::unlink(temporary.c_str());
    fail(path, "written");
  }
  sync_directory(std::filesystem::path(path).parent_path());
}

}  // namespace nullmark
