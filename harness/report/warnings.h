#pragma once

#include <optional>
#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// "0.1.0 (0123abc)": the version of the program that made the results, as far as they say; and of this one.
std::string measured_by(const RunRecord& run);
std::string this_version();

/// One line if another version of the program made the results.
std::optional<std::string> version_remark(const RunRecord& run);

/// If a timed thread waited for a larger share of the wall time than this, other work had its core.
inline constexpr Real kBusy = 0.05;

/// One line if a tree of bounds was not split in a medium that varies: it bounds no better than `global`.
std::optional<std::string> single_bound_remark(const RunRecord& run);

/// One line if times were taken on a busy machine.
std::optional<std::string> busy_remark(const RunRecord& run);

}  // namespace nullmark
