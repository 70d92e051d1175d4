#pragma once

#include <set>
#include <string>

namespace nullmark {

/// Names the cell that this thread works on while the object lives, so that whatever ends the process can tell it.  The name must
/// outlive the object.
class InFlight {
 public:
  explicit InFlight(const std::string& cell) noexcept;
  ~InFlight();
  InFlight(const InFlight&) = delete;
  InFlight& operator=(const InFlight&) = delete;

  /// The cell of this thread; of another one where this thread has none; null where nobody has.  May be called in a handler of
  /// signals.
  static const char* cell() noexcept;

  /// Those of all threads.
  static std::set<std::string> cells();

 private:
  const char* before_;
};

}  // namespace nullmark
