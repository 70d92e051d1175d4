#pragma once

#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"
#include "harness/registry/components.h"

namespace nullmark {

/// Throws InputError if a x b combinations are more.
void expect_cells(const JsonNode& node, std::size_t a, std::size_t b);

/// The components of an entry such as "ratio" or {"type": "ratio"}, with defaults and labels.  If parameters are lists, returns
/// all combinations, the first key varying slowest.
std::vector<Component> read_components(ComponentKind kind, const JsonNode& node);
std::vector<MediumSpec> read_media(const JsonNode& node);

/// Patterns: the type and the given parameters only.  A list matches any of its entries.
std::vector<Component> read_component_patterns(ComponentKind kind, const JsonNode& node);
std::vector<MediumSpec> read_medium_patterns(const JsonNode& node);
bool matches(const Component& pattern, const Component& component);
bool matches(const MediumSpec& pattern, const MediumSpec& medium);

}  // namespace nullmark
