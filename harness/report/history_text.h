#pragma once

#include <cstddef>
#include <string>

#include "harness/analysis/history.h"
#include "harness/io/json_input.h"

namespace nullmark {

/// "28 PASS, 2 FAIL": how many cells have each word, without those that no cell has.
std::string verdicts_counted(const RunRecord& run);

/// The meaning of the last step in one line: "3 of 54 cells changed since 2026-11-20 (commit 0123abc): 1 verdict, 2 slower".
std::string changes_line(const History& history);

/// The same of the step to results[result], short: "nothing", "nothing was compared", "2 cells: 1 verdict, 1 slower".  It names
/// the earlier result where that is not the one before; "-" of the first.
std::string change_shown(const History& history, std::size_t result);

/// What changed between the last two results that are compared, then all results.  Tables are at most `width` characters wide; 0:
/// any width.
std::string history_text(const History& history, std::size_t width);

/// The whole history, with the figures of every cell in every result; commands.md describes the format.
Json history_json(const History& history);

}  // namespace nullmark
