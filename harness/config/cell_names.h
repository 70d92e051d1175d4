#pragma once

#include <string>

#include "harness/model/names.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The label of a tracker: "ratio", "ratio/float".
inline std::string tracker_label(const Cell& cell) {
  return cell.precision == Precision::float64 ? cell.estimator.label : cell.estimator.label + "/" + to_string(cell.precision);
}

/// Gives every cell of a plan its id and its name: estimator/medium/majorant, with /float in single precision.  If cells of
/// different experiments would share a name, all names begin with the experiment.  If cells still share one, their differences
/// (seed, quantity, rays, samples, measurement, streams) are appended.
void name_cells(Plan& plan);

}  // namespace nullmark
