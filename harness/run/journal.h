#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// The cells of a run under way, one line each, beside the results file that will hold them: RESULTS.journal.  Every line reaches
/// the disk before `append` returns, so a run that is killed loses at most the cells it was at.  The open journal is also the
/// lock that keeps a second run off the same results.
class Journal {
 public:
  enum class Mode {
    fresh,     ///< refuses a journal that is there
    resume,    ///< goes on from a journal that is there
    overwrite  ///< forgets a journal that is there
  };

  /// Throws InputError where another run holds the lock, the journal is of another configuration, or it is damaged elsewhere than
  /// in its last line (which a kill may have torn, and which is then dropped).
  Journal(const std::string& results_path, const std::string& config_hash, Mode mode);
  /// Leaves the file for a later resume if it holds cells, removes it otherwise.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// What the journal held when it was opened; of a cell's lines the last counts.
  const std::vector<CellRecord>& cells() const { return cells_; }

  void append(const CellRecord& record);

  /// To be called once the results file is in place.
  void remove();

  static std::string path_for(const std::string& results_path) { return results_path + ".journal"; }

 private:
  void lock();
  void read(const std::string& config_hash, Mode mode);
  void write_header(const std::string& config_hash);

  std::string path_;
  int file_ = -1;
  bool holds_cells_ = false;
  std::vector<CellRecord> cells_;
};

}  // namespace nullmark
