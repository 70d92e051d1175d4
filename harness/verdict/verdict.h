#pragma once

#include "harness/model/record.h"

namespace nullmark {

/// What one test proves about the mean error.  All can be false if too few samples were drawn.
struct Proof {
  bool biased = false;  ///< mean error != 0: E0 >= 1/alpha_fail
  bool beyond = false;  ///< |mean error| > epsilon: the evidence against both sides of it averages to 1/alpha_fail or more
  bool within = false;  ///< |mean error| < epsilon: E- and E+ >= 1/alpha_pass each, an intersection-union test
};

/// Derived from the figures of the record alone.  `alpha_fail` is the level of one claim; a test makes two, "biased" and
/// "beyond".  A deterministic test is within epsilon where no sample is off by more, and biased where its bets prove it.
Proof proven(const TestRecord& test, Real alpha_fail, Real alpha_pass);

/// Derives the outcomes of all tests of a verdict, and of the cell, from the figures in the record alone.
///
///   tolerate nothing   FAIL: a bias is proven.  PASS: every test is within epsilon, and the planned samples were drawn.
///   tolerate epsilon   FAIL: a bias beyond epsilon is proven.  PASS: every test is within epsilon.
///
/// Otherwise INCONCLUSIVE.  `outputs` names the tested outputs if they are not channels; `range` is the name of the declared
/// range, for the reason.
void decide(VerdictRecord& verdict, const std::vector<std::string>& outputs = {}, const std::string& range = {});

/// What a PASS excludes: |mean error| over all rays, relative to the reference; the largest over the tests of means.
Real excluded_bias(const VerdictRecord& verdict);
/// The same over groups of rays; 0 where none is tested.
Real excluded_bias_of_groups(const VerdictRecord& verdict);

/// Whether laws of walks were tested.  "replay" and "variance" are laws of samples and do not count.
bool tests_walks(const VerdictRecord& verdict);

}  // namespace nullmark
