#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// Above this relative variance a sample variance tells little; tables show the theory instead, marked.
inline constexpr Real kHeavyTail = 100;

/// Numbers that one sample of a cell gives: those of its quantity, else one a channel.
int outputs_of(const CellRecord& record);

/// What a table may show.
const std::vector<std::string>& metric_names();

/// Those of them that have a standard error, so that a claim on them can be decided.
const std::vector<std::string>& claimable_metric_names();

/// A metric of a cell, averaged over its channels (root mean square for "rmse"), and what theory says of it; nothing where it is
/// not known.
std::optional<Real> metric(const CellRecord& record, std::string_view name);
std::optional<Real> metric_theory(const CellRecord& record, std::string_view name);

/// Standard error of `metric`, never too small where rays differ; 0 for what is counted exactly, nothing where it is not known.
std::optional<Real> standard_error(const CellRecord& record, std::string_view name);

/// Of a sample: the analytic one where known, else as measured.
const std::optional<Real>& best_variance(const ChannelRecord& channel);

/// variance x lookups and variance x ns: lower is better.  Variance is the analytic one where known.
std::optional<Real> variance_x_lookups(const CellRecord& record, std::size_t channel);
std::optional<Real> variance_x_ns(const CellRecord& record, std::size_t channel);

}  // namespace nullmark
