#pragma once

#include "harness/record.h"

namespace nullmark {

/// FAIL: E0 >= 1/alpha of the fail level.  PASS: both E- and E+ >= 1/alpha of the pass level; that is an intersection-union test,
/// so certifying many cells needs no correction.  Else INCONCLUSIVE.
Outcome decide(const TestRecord& test, Real alpha_fail, Real alpha_pass);

/// Fills in the outcomes of all tests of a verdict and what follows for the cell, from the figures in the record alone.
/// `outputs` are the names of what is tested, where it is not channels.
void decide(VerdictRecord& verdict, const std::vector<std::string>& outputs = {});

}  // namespace nullmark
