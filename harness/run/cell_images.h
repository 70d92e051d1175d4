#pragma once

#include "harness/model/record.h"
#include "harness/run/run.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/sampling/sampling.h"

namespace nullmark {

/// Writes the pictures of a cell that asks for them, and names them in its record: mean, reference, variance, lookups and null
/// collisions as PNG, all figures of all pixels as EXR.  Where that fails the observer is warned.
void write_images(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled, const RunOptions& options,
                  const RunObserver& observer);

}  // namespace nullmark
