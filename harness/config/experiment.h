#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"

namespace nullmark {

/// A cell while its experiment is expanded: specifications in place of indices.
struct ConfiguredCell {
  std::string experiment;  ///< as the file calls it
  std::optional<Component> estimator, rays;
  std::optional<MediumSpec> medium;
  std::optional<Component> majorant;
  bool has_samples = false;
  Cell cell;
};

/// Whether a pattern, a partial cell, fits a cell.
using Test = std::function<bool(const ConfiguredCell&)>;

/// Keys by which cells of an experiment differ.
const std::vector<std::string>& axes();

/// A partial cell; all keys that are given must match.  Keys in `also` are someone else's.
Test read_pattern(const JsonNode& node, const std::vector<std::string>& also = {});

/// Whether two cells agree on an axis.
bool agree_on(const std::string& axis, const ConfiguredCell& a, const ConfiguredCell& b);

/// Throws InputError where a configuration has a key by the name it had in version 1.
void refuse_renamed(const JsonNode& node, const char* before, const char* now);

/// The cells of an experiment (format: config.md).  `seed` is that of cells that name none.
std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed);

}  // namespace nullmark
