#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/model/record.h"
#include "harness/run/build.h"

namespace nullmark {

/// The finished cells of a running run, one line each, beside its future results file: RESULTS.journal.  A killed run loses at
/// most the cells in progress, a power cut also those that were appended since the journal last settled.  The open journal is
/// also a lock against a second run with the same results file.
class Journal {
 public:
  enum class Mode {
    fresh,     ///< refuses an existing journal
    resume,    ///< continues from an existing journal
    overwrite  ///< discards an existing journal
  };

  /// Throws InputError if another run holds the lock, or if the journal belongs to another configuration or to a build whose
  /// cells may not be joined with those of `build`, that of the run; cells of one that may are marked.  A damaged last line,
  /// which a kill can leave, is dropped; any other line that is no cell is skipped with a warning.
  Journal(const std::string& results_path, const std::string& config_hash, Mode mode, Build build = this_build(),
          Builds builds = Builds::same);
  /// Keeps the file for a later resume if it holds cells, removes it otherwise.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Cells in the journal when it was opened; the last line of a cell counts.
  const std::vector<CellRecord>& cells() const { return cells_; }

  void append(const CellRecord& record);
  /// Puts on disk what was appended.
  void settle();

  /// Call once the results file is in place.
  void remove();

  static std::string path_for(const std::string& results_path) { return results_path + ".journal"; }

 private:
  void lock();
  void read(const std::string& config_hash, Mode mode);
  void read_head(const JsonNode& node, const std::string& config_hash);
  void read_line(const std::string& line, const std::string& where, const std::string& config_hash);
  std::string head(const std::string& config_hash) const;
  void write_head(const std::string& config_hash);
  void expect_own(const std::string& text, const std::string& config_hash) const;

  std::string path_;
  int file_ = -1;
  bool holds_cells_ = false;
  Build build_, of_lines_;  ///< of this run; of the lines that are being read
  Builds builds_;
  std::vector<CellRecord> cells_;
  std::map<std::pair<std::string, std::string>, std::size_t> place_;  ///< of a cell by its id and name
};

}  // namespace nullmark
