#pragma once

#include <stdexcept>

namespace nullmark {

/// What a tracker from outside did wrong, as one line.  It ends the cell.
struct TrackerFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace nullmark
