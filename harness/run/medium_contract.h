#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "media/base/medium.h"

namespace nullmark {

/// One promise of a medium, and whether it was kept.
struct ContractFinding {
  std::string what;
  bool kept = false;
  std::string detail;  ///< the first counterexample
};

/// Tries what trackers and references rely on, at fixed random points, boxes and rays, in every channel:
///
///   - extinction is finite and >= 0, the same in a block as alone, and in float as in double to 1e-5 of the largest;
///   - extrema bound it in boxes from the whole medium down to 1e-9 of it, and the average lies between them;
///   - knots lie inside their ray;
///   - the closed form of the optical depth, where there is one, is the adaptive Gauss-Kronrod integral between knots to 1e-9,
///   and
///     its inverse leads back to it; without a closed form, the integral between knots agrees with one of 4096 panels to 1e-3.
///
/// `medium` is a name, or an object as in a configuration; of a sweep each member is tried.  Throws InputError, ParameterError
/// and MissingData.
std::vector<ContractFinding> check_medium(const Json& medium);
std::vector<ContractFinding> check_medium(const Medium& medium);

}  // namespace nullmark
