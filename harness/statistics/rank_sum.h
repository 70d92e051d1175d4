#pragma once

#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Two-sided probability of the rank sum of Mann and Whitney [1947] of two samples, of at most 64 numbers each: exact for
/// distributions without ties, an upper bound with them.  Whatever the distribution, it is at most p in no more than p of all
/// pairs of samples of the same one.  1 where a sample is empty.
Real rank_sum_probability(const std::vector<Real>& first, const std::vector<Real>& second);

}  // namespace nullmark
