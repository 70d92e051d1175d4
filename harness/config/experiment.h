#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"

namespace nullmark {

/// A cell during the expansion of its experiment: it holds specifications instead of indices.
struct ConfiguredCell {
  std::string experiment;  ///< its name in the file
  std::optional<Component> estimator, rays;
  std::optional<MediumSpec> medium;
  std::optional<Component> majorant;
  bool has_samples = false;
  Cell cell;
};

/// Whether a cell matches a pattern.
using Test = std::function<bool(const ConfiguredCell&)>;

/// Keys in which the cells of an experiment can differ.
const std::vector<std::string>& axes();

/// Reads a pattern: all its keys must match.  Keys in `also` are allowed and ignored.
Test read_pattern(const JsonNode& node, const std::vector<std::string>& also = {});

/// Whether two cells agree on an axis.
bool agree_on(const std::string& axis, const ConfiguredCell& a, const ConfiguredCell& b);

/// Throws InputError if a configuration uses the name that a key had in version 1.
void refuse_renamed(const JsonNode& node, const char* before, const char* now);

/// The cells of an experiment (format: config.md).  Cells that name no seed get `seed`.
std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed);

}  // namespace nullmark
