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
  std::optional<Shared<Component>> estimator, minus, majorant, rays;
  std::optional<Shared<MediumSpec>> medium;
  bool has_samples = false;
  Cell cell;
};

/// Gives a cell one value of a key.
using Setter = std::function<void(ConfiguredCell&)>;

/// Whether a cell matches a pattern.
using Test = std::function<bool(const ConfiguredCell&)>;

/// A key in which the cells of an experiment can differ.
struct Axis {
  std::string name;
  std::function<std::vector<Setter>(const JsonNode&)> read;                 ///< the values that a file lists
  std::function<Test(const JsonNode&)> pattern;                             ///< whether a cell has one of them
  std::function<bool(const ConfiguredCell&, const ConfiguredCell&)> agree;  ///< whether two cells have the same
  Json schema;                                                              ///< of one value
  bool partial = false;                                                     ///< a pattern may leave parameters out
};

const std::vector<Axis>& axes();
const std::vector<std::string>& axis_names();

/// A key that all cells of an experiment share.
struct SharedKey {
  std::string name;
  std::function<Setter(const JsonNode&)> read;
  Json schema;
};

const std::vector<SharedKey>& shared_keys();

}  // namespace nullmark
