#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "harness/config/axes.h"

namespace nullmark {

/// A partial cell; all keys that are given must match.  Keys in `also` are someone else's.
Test read_pattern(const JsonNode& node, const std::vector<std::string>& also = {});

/// Throws InputError where a configuration has a key by the name it had in version 1.
void refuse_renamed(const JsonNode& node, const char* before, const char* now);

/// The cells of an experiment (format: config.md).  `seed` is that of cells that name none.
std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed);

}  // namespace nullmark
