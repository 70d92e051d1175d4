#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// Above this relative variance a sample variance says little; tables show the value from theory instead, with a mark.
inline constexpr Real kHeavyTail = 100;

/// Numbers that one sample of a cell gives: one per output of its quantity, or one per channel.
int outputs_of(const CellRecord& record);

/// Metrics that a table can show.
const std::vector<std::string>& metric_names();

/// Metrics with a standard error: claims can test them.
const std::vector<std::string>& claimable_metric_names();

/// A metric of a cell, averaged over its channels (root mean square for "rmse"), and its value from theory; nothing if unknown.
std::optional<Real> metric(const CellRecord& record, std::string_view name);
std::optional<Real> metric_theory(const CellRecord& record, std::string_view name);

/// Standard error of `metric`; not underestimated if rays differ.  0 for exact counts, nothing if unknown.
std::optional<Real> standard_error(const CellRecord& record, std::string_view name);

/// Variance of a sample: analytic if known, else measured.
const std::optional<Real>& best_variance(const ChannelRecord& channel);

/// variance x lookups and variance x ns: lower is better.  The variance is analytic if known.
std::optional<Real> variance_x_lookups(const CellRecord& record, std::size_t channel);
std::optional<Real> variance_x_ns(const CellRecord& record, std::size_t channel);

}  // namespace nullmark
