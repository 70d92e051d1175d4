#pragma once

#include "harness/json_input.h"
#include "harness/record.h"

namespace nullmark {

/// "PASS", "FAIL", "INCONCLUSIVE", "VIOLATED", or "" for none.
const char* to_string(Outcome outcome);

Json verdict_json(const VerdictRecord& verdict);

/// Throws InputError.
VerdictRecord read_verdict(const Place& place);

}  // namespace nullmark
