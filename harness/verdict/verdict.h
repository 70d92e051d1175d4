#pragma once

#include "harness/model/record.h"

namespace nullmark {

/// What one test proves of the mean error; each may be false, as not enough was drawn.
struct Proof {
  bool biased = false;  ///< mean error != 0: E0 >= 1/alpha_fail
  bool beyond = false;  ///< |mean error| > epsilon: the evidence against both sides of it averages to 1/alpha_fail or more
  bool within = false;  ///< |mean error| < epsilon: E- and E+ >= 1/alpha_pass each, an intersection-union test
};

/// Derived from the figures of the record alone.  `alpha_fail` is the level of one claim: a test makes two of them, "biased" and
/// "beyond".  Whatever is deterministic proves all it can by its largest error.
Proof proven(const TestRecord& test, Real alpha_fail, Real alpha_pass);

/// Fills in the outcomes of all tests of a verdict and what follows for the cell, from the figures in the record alone.
///
///   tolerate nothing   FAIL: a bias is proven.  PASS: every test is within epsilon, and the planned samples were drawn.
///   tolerate epsilon   FAIL: a bias beyond epsilon is proven.  PASS: every test is within epsilon.
///
/// Else INCONCLUSIVE.  `outputs` are the names of what is tested, where it is not channels.
void decide(VerdictRecord& verdict, const std::vector<std::string>& outputs = {});

/// Whether laws of walks were tested; "replay" and "variance" are of samples, and cells have them whatever their walks.
bool tests_walks(const VerdictRecord& verdict);

}  // namespace nullmark
