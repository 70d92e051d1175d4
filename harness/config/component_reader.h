#pragma once

#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"
#include "harness/registry/components.h"

namespace nullmark {

/// Throws InputError where a x b combinations are more than a plan may have: a few lists in a small file could fill any memory.
void expect_cells(const JsonNode& node, std::size_t a, std::size_t b);

/// The components that a configuration's entry stands for, complete with defaults and labels: "ratio", {"type": "ratio"}, or with
/// lists in place of single parameter values, all combinations of them, the first key varying slowest.
std::vector<Component> read_components(ComponentKind kind, const JsonNode& node);
std::vector<MediumSpec> read_media(const JsonNode& node);

/// Partial specifications: type and the parameters that are given, nothing else.  A list stands for any of its entries.
std::vector<Component> read_component_patterns(ComponentKind kind, const JsonNode& node);
std::vector<MediumSpec> read_medium_patterns(const JsonNode& node);
bool matches(const Component& pattern, const Component& component);
bool matches(const MediumSpec& pattern, const MediumSpec& medium);

}  // namespace nullmark
