#pragma once

#include <string>

#include "harness/model/names.h"
#include "harness/model/plan.h"

namespace nullmark {

/// Of one tracker among others: "ratio", "ratio/float".
inline std::string tracker_label(const Cell& cell) {
  return cell.precision == Precision::float64 ? cell.estimator.label : cell.estimator.label + "/" + to_string(cell.precision);
}

/// Gives every cell of a plan its id and its name: estimator/medium/majorant, and /float where that is its precision.  Where
/// cells of different experiments would share one, all names begin with the experiment; where cells still do, what they differ in
/// (seed, quantity, rays, samples, measurement, streams) is appended.
void name_cells(Plan& plan);

}  // namespace nullmark
