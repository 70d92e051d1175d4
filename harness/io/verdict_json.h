#pragma once

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

Json verdict_json(const VerdictRecord& verdict);

/// Throws InputError.
VerdictRecord read_verdict(const JsonNode& node);

/// JSON Schema; null where nothing was tested.
Json verdict_schema();

}  // namespace nullmark
