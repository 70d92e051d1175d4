#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The scenes on which `nullmark prove` tries one tracker: media of many shapes whose boxes neither begin at 0 nor have length 1,
/// tight and loose bounds, local bounds whose cells do not fit the medium's, rays that begin outside, oblique rays, rays that
/// miss, channels, depths from .1 to 8, single precision, and bounds that are too low for trackers that claim to bear it.
struct Battery {
  Plan plan;
  std::vector<bool> selected;         ///< cells that the tracker's parameters allow
  std::vector<std::string> left_out;  ///< experiments of which no cell is selected, with the reason
};

/// `estimator` is a name, or an object as in a configuration's matrix; `medium` likewise, or null for all of them.  `quick` takes
/// an eighth of the samples and fewer media.  Throws InputError and ParameterError.
Battery make_battery(const Json& estimator, const Json& medium, bool quick);

}  // namespace nullmark
