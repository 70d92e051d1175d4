#pragma once

#include "harness/model/plan.h"

namespace nullmark {

/// The least normal number of a precision; numbers below have fewer digits than others.
Real least_of(Precision precision);

/// What single precision may add to a mean: every factor of a weight is off by a few units in its last place, and all of them
/// may be so to the same side, and numbers below the least normal one have no digits left.  0 in double.
Real single_error(const Cell& cell, Real mean, Real lookups);

/// The absolute margin epsilon of an output of that mean.  Where hardly anything is absorbed it shrinks with 1 - T, or a tracker
/// that sees no medium at all would pass.
Real absolute_epsilon(const Cell& cell, Real mean);

}  // namespace nullmark
