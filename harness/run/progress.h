#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// Shows the progress of a run on stderr: a bar on a terminal (coloured unless NO_COLOR is set), otherwise one line per cell and
/// one after 30 s of silence, or nothing.
class Progress {
 public:
  enum class Lines { each_cell, none };

  Progress(std::size_t total, Lines lines = Lines::each_cell);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void cell_progress(const CellRecord& record, double fraction);
  void cell_done(const CellRecord& record, std::size_t done, std::size_t total);
  void timing(double fraction, std::size_t cells);
  void warning(const std::string& message);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double done, const std::string& doing);
  void clear();

  std::size_t total_, done_ = 0, timed_ = 0;
  bool terminal_, lines_, colour_, drawn_ = false;
  Clock::time_point start_ = Clock::now(), last_told_ = start_, last_drawn_{};
};

}  // namespace nullmark
