#pragma once

#include "harness/analysis/history.h"

namespace nullmark {

/// What changed from one result to a later one.  `blocks` compare the programs of these two; they are ignored where empty.
HistoryStep compare_results(const HistoryResult& before, const HistoryResult& after, const std::vector<TimedBlock>& blocks);

}  // namespace nullmark
