#pragma once

#include "harness/plan.h"

namespace nullmark {

/// Gives every cell of a plan its id and its name: estimator/medium/majorant.  Where cells of different experiments would share
/// one, all names begin with the experiment; where cells still do, what they differ in (seed, quantity, rays, samples,
/// measurement, streams) is appended.
void name_cells(Plan& plan);

}  // namespace nullmark
