#pragma once

#include <string>

#include "harness/model/record.h"
#include "harness/performance_gate/performance_gate.h"

namespace nullmark {

/// The counts in results of `nullmark run`: of every cell that was sampled without error.
Counts counts_of(const RunRecord& run, const std::string& file);

/// A file of results or a baseline.  Throws InputError.
Counts read_counts(const std::string& file);

/// The baseline of the same configuration and build in a folder of them.  Nothing where there is none; `remedy` then says which
/// are there and how one is made.  Throws InputError where a file in the folder cannot be read.
std::optional<Counts> find_baseline(const std::string& folder, const Counts& of, std::string& remedy);

/// NAME.COMPILER.ARCHITECTURE.HASH.json, the hash being that of the build.  A changed configuration keeps its file, so that
/// version control shows what changed.
std::string baseline_file_name(const Counts& counts);

/// A baseline: counts alone, one cell a line.
std::string baseline_text(const Counts& counts);

/// What the next baseline is: the new counts, with the history of the instructions carried on.  Changes within a cell's threshold
/// join its history; a change beyond it is a change of the code, whose history begins anew.  Throws InputError where the new
/// counts would lose cells, instructions, misses or the start-up that the old baseline of the same configuration has.
Counts refreshed(const Counts& before, Counts after);

}  // namespace nullmark
