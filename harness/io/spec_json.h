#pragma once

#include <string>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"
#include "harness/registry/components.h"

namespace nullmark {

/// The first key of a configuration.
inline constexpr const char *kVersionKey = "nullmark", *kConfigVersion = "config/2";

/// Parts of a plan as a configuration writes them, complete: every parameter stands there.
Json parameters_json(const ParameterValues& values);
Json component_json(const Component& component);
Json medium_json(const MediumSpec& medium);
/// Adds what a medium does to light beside removing it: albedo, anisotropy, emission.
void add_matter(Json& json, const MediumSpec& medium);

/// What decides a cell's statistics, as canonical text, hashed to 16 hexadecimal digits.
std::string cell_id(const Plan& plan, const Cell& cell);

/// The plan as a configuration that names every cell explicitly; reading it gives the same plan.  One line, canonical.
std::string applied_config(const Plan& plan);

/// 16 hexadecimal digits; equal for equal plans.
std::string config_hash(const std::string& config_text);

}  // namespace nullmark
