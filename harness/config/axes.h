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

/// Gives a cell one value of a key.
using Setter = std::function<void(ConfiguredCell&)>;

/// Whether a pattern, a partial cell, fits a cell.
using Test = std::function<bool(const ConfiguredCell&)>;

/// A key by which the cells of an experiment differ.
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
