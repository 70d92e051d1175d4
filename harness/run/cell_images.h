#pragma once

#include "harness/model/record.h"
#include "harness/run/run.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/sampling/sampling.h"

namespace nullmark {

/// If the cell has `images`, writes its pictures and names them in its record: mean, reference, variance, lookups and null
/// collisions as PNG, all figures of all pixels as EXR.  If that fails, the observer gets a warning.
void write_images(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled, const RunOptions& options,
                  const RunObserver& observer);

}  // namespace nullmark
