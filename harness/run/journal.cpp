#include "harness/run/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "harness/io/consistency.h"
#include "harness/io/file_io.h"
#include "harness/io/notice.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"

namespace nullmark {
namespace {

constexpr int kJournalSchema = 2;
constexpr const char* kHead = "nullmark_journal";

/// Whether the path still leads to the open file: its last owner may have removed it between open and lock.
bool still_there(int file, const std::string& path) {
  struct stat opened, named;
  return ::fstat(file, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
         opened.st_dev == named.st_dev;
}

}  // namespace

Journal::Journal(const std::string& results_path, const std::string& config_hash, Mode mode, Build build, Builds builds)
    : path_(path_for(results_path)), build_(std::move(build)), builds_(builds) {
  expect_replaceable(results_path);
  lock();
  try {
    remove_leftovers(results_path);
    read(config_hash, mode);
    // Also the name of a journal that a killed run left: a sync of the file does not keep it.
    make_name_durable(path_);
  } catch (...) {
    ::close(file_);
    throw;
  }
}

Journal::~Journal() {
  if (file_ < 0) return;
  if (!holds_cells_) ::unlink(path_.c_str());
  ::close(file_);
}

void Journal::lock() {
  for (;;) {
    // Neither through a link, whose target would be emptied, nor into a pipe that nobody reads.
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (file_ < 0 && errno == ELOOP)
      throw InputError(path_ + ": is a link, and a journal is a file; remove it or give another -o");
    if (file_ < 0 && errno == EISDIR)
      throw InputError(path_ + ": is a folder, and a journal is a file; remove it or give another -o");
    if (file_ < 0)
      throw InputError(
          fmt::format("{}: cannot be written: {}; give -o a path in an existing, writable folder", path_, std::strerror(errno)));
    if (struct stat opened; ::fstat(file_, &opened) != 0 || !S_ISREG(opened.st_mode)) {
      ::close(file_);
      throw InputError(path_ + ": is not a regular file; remove it or give another -o");
    }
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
      ::close(file_);
      throw InputError(path_ + ": another run is writing these results; wait for it or give another -o");
    }
    if (still_there(file_, path_)) return;
    ::close(file_);
  }
}

void Journal::read(const std::string& config_hash, Mode mode) {
  const std::string text = read_file(path_);
  expect_own(text, config_hash);
  const std::size_t first_end = text.find('\n');
  std::size_t complete = first_end == std::string::npos ? 0 : text.rfind('\n') + 1;
  // After a power cut, unsynced bytes may read as zeros.  A head that is not synced has no lines behind it.
  const bool torn_head = first_end + 1 == complete && text.find('\0') < first_end && mode == Mode::resume;
  if (torn_head) complete = 0;
  if (complete == 0 || mode == Mode::overwrite) {
    if (::ftruncate(file_, 0) != 0) throw InputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
    write_head(config_hash);
    return;
  }
  if (mode == Mode::fresh)
    throw InputError(path_ + ": left by a run that did not finish; --resume continues it, --force starts again");

  int number = 0;
  for (std::size_t begin = 0; begin < complete;) {
    const std::size_t end = text.find('\n', begin);
    const std::string line = text.substr(begin, end - begin), where = fmt::format("{}:{}", path_, ++number);
    begin = end + 1;
    if (number > 1) {
      read_line(line, where, config_hash);
      continue;
    }
    Json head;
    try {
      head = parse_json(line, where);
      JsonNode(head, where)[kHead].integer(0, 1'000'000);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}; the journal is damaged: --force starts again", error.what()));
    }
    read_head(JsonNode(head, where), config_hash);
  }
  holds_cells_ = !cells_.empty();
  if (complete < text.size() && ::ftruncate(file_, static_cast<off_t>(complete)) != 0)
    throw InputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  // Cells that this run appends are of its own build.
  if (of_lines_.environment != build_.environment || of_lines_.plugin_hash != build_.plugin_hash) write_head(config_hash);
}

/// The cells after it are of the build that it names.
void Journal::read_head(const JsonNode& node, const std::string& config_hash) {
  node.expect_object();
  if (node[kHead].integer(0, 1'000'000) != kJournalSchema)
    node[kHead].expected(fmt::format("{}, the journal this program writes", kJournalSchema));
  if (const JsonNode version = node[kVersionKey]; version.string() != RunRecord::kVersion)
    version.expected(fmt::format("\"{}\", which this program writes", RunRecord::kVersion));
  if (node["config_hash"].string() != config_hash)
    node["config_hash"].expected(
        fmt::format("\"{}\": the journal is of another configuration or seed; --force starts again", config_hash));
  of_lines_ = read_build(node["build"]);
  expect_joinable(path_, of_lines_, "this program", build_, builds_);
}

void Journal::read_line(const std::string& line, const std::string& where, const std::string& config_hash) {
  Json json;
  CellRecord record;
  try {
    json = parse_json(line, where);
    const JsonNode node(json, where);
    if (!json.contains(kHead)) {
      record = read_cell(node);
      expect_consistent(record, node);
    }
  } catch (const InputError& error) {
    // What another program wrote there costs the cell of that line, not the others.
    notice("nullmark: warning: {}; the line is skipped\n", error.what());
    return;
  }
  if (json.contains(kHead)) return read_head(JsonNode(json, where), config_hash);
  mark_build(record, of_lines_, build_);
  const auto [at, fresh] = place_.try_emplace({record.cell.id, record.cell.name}, cells_.size());
  if (fresh)
    cells_.push_back(std::move(record));
  else
    cells_[at->second] = std::move(record);
}

std::string Journal::head(const std::string& config_hash) const {
  const Json head = {
      {kHead, kJournalSchema}, {kVersionKey, RunRecord::kVersion}, {"config_hash", config_hash}, {"build", build_json(build_)}};
  return head.dump() + "\n";
}

void Journal::write_head(const std::string& config_hash) {
  write_all(file_, head(config_hash), path_);
  make_durable(file_, path_);
}

/// Refuses a file that no run has left: opening a journal may empty it.
void Journal::expect_own(const std::string& text, const std::string& config_hash) const {
  const std::size_t told = std::min(std::strlen(kHead) + std::strlen("{\"\":"), text.size());
  const std::string_view beginning = std::string_view(text).substr(0, told);
  // After a power cut, unsynced bytes may read as zeros.
  if (beginning != head(config_hash).substr(0, told) && beginning.find('\0') == std::string_view::npos)
    throw InputError(path_ + ": is not the journal of a run; move the file, or give another -o");
}

void Journal::append(const CellRecord& record) {
  holds_cells_ = true;
  write_all(file_, cell_json(record).dump() + "\n", path_);
}

void Journal::settle() { make_durable(file_, path_); }

void Journal::remove() {
  // Under the lock, so that no other run can have begun to use the file.
  ::unlink(path_.c_str());
  ::close(file_);
  file_ = -1;
}

}  // namespace nullmark
