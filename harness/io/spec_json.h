#pragma once

#include <string>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"
#include "harness/registry/components.h"

namespace nullmark {

/// The first key of a configuration.
inline constexpr const char *kVersionKey = "nullmark", *kConfigVersion = "config/2";

/// Parts of a plan as JSON of a configuration, with every parameter.
Json parameters_json(const ParameterValues& values);
Json component_json(const Component& component);
Json medium_json(const MediumSpec& medium);
/// Adds a medium's effects on light beside extinction: albedo, anisotropy, emission.
void add_matter(Json& json, const MediumSpec& medium);

/// The plan as a configuration that names every cell explicitly; reading it gives the same plan.  One line, canonical.
std::string applied_config(const Plan& plan);

/// 16 hexadecimal digits; equal for equal plans.
std::string config_hash(const std::string& config_text);

}  // namespace nullmark
