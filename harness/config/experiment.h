#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "harness/config/axes.h"

namespace nullmark {

/// Reads a pattern: all its keys must match.  Keys in `also` are allowed and ignored.
Test read_pattern(const JsonNode& node, const std::vector<std::string>& also = {});

/// Throws InputError if a configuration uses the name that a key had in version 1.
void refuse_renamed(const JsonNode& node, const char* before, const char* now);

/// The cells of an experiment (format: config.md).  Cells that name no seed get `seed`.
std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed);

}  // namespace nullmark
