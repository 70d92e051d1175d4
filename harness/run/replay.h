#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/record.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {

/// Selects a sample of a cell.
struct SampleChoice {
  std::optional<std::uint64_t> ray, sample;
};

/// One sample of a cell, drawn again on its own.
struct Replay {
  std::string cell;
  std::uint64_t ray = 0, sample = 0;
  std::uint64_t held = 0;  ///< samples of each ray that the results drew, pilots aside
  Ray world;               ///< cut to the medium
  Quantity quantity = Quantity::transmittance;
  Precision precision = Precision::float64;
  int channels = 1;
  std::vector<std::string> outputs;          ///< names of the values
  std::vector<Real> values;                  ///< as drawn, before a measurement's clamp and quantisation
  std::vector<std::optional<Real>> targets;  ///< their means, where known
  std::uint32_t lookups = 0;
  std::vector<Real> draws;  ///< uniform numbers in [0, 1), in their order
  /// Its one flight.  Without steps for a path, which has many flights, and in float, where registers record none.
  Recording::Walk walk;
  /// [step * channels + c]: the estimate of T up to and including each lookup; empty for trackers without profiles.
  std::vector<Real> transmittance;
};

/// Draws a sample of a cell of the results again.  Without a choice it searches the drawn samples of all rays, or of the chosen
/// ray, for the one that disturbs the mean most: the first that is not finite, else the first of those farthest from the target
/// of their ray (from 0 if none is known).
///
/// Throws InputError if the results hold no such cell, ray or configuration, or if the medium's data have changed.
Replay replay_sample(const RunRecord& run, const std::string& file, const std::string& cell, const SampleChoice& choice);

/// With all digits; what is not finite is a string.
Json replay_json(const Replay& replay);
/// The result of the sample, and a table of its steps.
std::string replay_text(const Replay& replay);

}  // namespace nullmark
