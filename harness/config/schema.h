#pragma once

#include <string>

#include "harness/io/json_input.h"
#include "harness/registry/components.h"

namespace nullmark {

/// JSON Schema (draft-07) of the configuration, generated from the registries.
Json config_schema();

/// JSON Schema (draft-07) of the results.
Json results_schema();

/// A parameter's own schema: type, default, range and description, without sweeps.
Json parameter_schema(const ParameterInfo& parameter);

}  // namespace nullmark
