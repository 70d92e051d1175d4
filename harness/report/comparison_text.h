#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// A table per comparison (harness/analysis/comparison.h): trackers by time to 1 % relative error, each number with its 95 %
/// interval, beside the baseline (default: the first that is unbiased); with `paired`, ratios of mean squared errors on common
/// streams as well. Empty where no cell was sampled.  Throws InputError when the baseline names no estimator of the results.
std::string compare_text(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired);

/// The same for a pull request.
std::string compare_markdown(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired);

}  // namespace nullmark
