#pragma once

#include <string>

#include "harness/model/names.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The label of a tracker: "ratio", "ratio/float".
inline std::string tracker_label(const Cell& cell) {
  std::string label = cell.estimator->label;
  if (cell.minus) label += "/minus:" + (*cell.minus)->label;
  if (cell.precision != Precision::float64) label += "/" + to_string(cell.precision);
  if (!cell.lanes) label += "/one_walk";
  return label;
}

/// Gives every cell of a plan its id and its name: estimator/medium/majorant, with /float in single precision and /one_walk
/// without lanes.  If cells of different experiments would share a name, all names begin with the experiment.  If cells still
/// share one, their differences (seed, quantity, rays, samples, measurement, streams) are appended.
void name_cells(Plan& plan);

}  // namespace nullmark
