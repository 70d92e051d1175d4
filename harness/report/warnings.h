#pragma once

#include <optional>
#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// "0.1.0 (0123abc)", of the program that made the results, as far as they say; and of this one.
std::string measured_by(const RunRecord& run);
std::string this_version();

/// One line where the results say that they are of another version than this program, whose verdicts and tables they get.
std::optional<std::string> version_remark(const RunRecord& run);

/// A timed thread that waited for a larger share of the wall time than this was kept from its core by other work.
inline constexpr Real kBusy = 0.05;

/// One line where times were taken on a busy machine.
std::optional<std::string> busy_remark(const RunRecord& run);

}  // namespace nullmark
