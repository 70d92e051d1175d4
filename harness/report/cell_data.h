#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "harness/analysis/comparison.h"
#include "harness/io/json_input.h"
#include "harness/model/cost.h"
#include "harness/model/record.h"
#include "harness/report/images.h"

namespace nullmark {

/// A cell of the report's data (format: report.md), without its cost and convergence.
Json cell_json_of(const CellRecord& record, std::size_t run, ReportImages& images, const std::string& file);

/// The cost of a cell, and its measured error over samples.
Json cost_json(const RankedCell& ranked);
Json convergence_row(const CellRecord& record, const std::optional<Cost>& cost);

/// JSON of an interval, or of an index into a list; null if there is none.
Json interval(const Interval& x);
Json interval(const std::optional<Interval>& x);
Json place(const std::optional<std::size_t>& at);

}  // namespace nullmark
