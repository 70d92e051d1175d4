#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/record.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {

/// Which sample of a cell.
struct SampleChoice {
  std::optional<std::uint64_t> ray, sample;
};

/// One sample of a cell, drawn again alone.
struct Replay {
  std::string cell;
  std::uint64_t ray = 0, sample = 0;
  Ray world;  ///< cut to the medium
  Quantity quantity = Quantity::transmittance;
  Precision precision = Precision::float64;
  int channels = 1;
  std::vector<std::string> outputs;          ///< what each value is
  std::vector<Real> values;                  ///< as drawn, before a measurement's clamp and quantisation
  std::vector<std::optional<Real>> targets;  ///< their means, where known
  std::uint32_t lookups = 0;
  std::vector<Real> draws;  ///< uniform numbers in [0, 1), in their order
  /// Its one flight; without steps where it was a path, which flies many times, and in float, where registers write none down.
  Recording::Walk walk;
  /// [step * channels + c]: the estimate of T up to each lookup, that included; empty of trackers that tell no profile.
  std::vector<Real> transmittance;
};

/// Draws a sample of a cell of the results again.  Where no sample is chosen it is the one that a mean suffers from most, among
/// those that the record says were drawn, of all rays or of the chosen one: the first that is not finite, else the first of those
/// farthest from their ray's target (from 0 where none is known).
///
/// Throws InputError where the results hold no such cell, ray or configuration, or where the medium's data are others by now.
Replay replay_sample(const RunRecord& run, const std::string& file, const std::string& cell, const SampleChoice& choice);

/// With all digits; what is not finite is a string.
Json replay_json(const Replay& replay);
/// What the sample gave, over a table of its steps.
std::string replay_text(const Replay& replay);

}  // namespace nullmark
