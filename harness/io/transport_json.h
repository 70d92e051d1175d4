#pragma once

#include <string>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"

namespace nullmark {

/// {"environment": 1, "surfaces": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "radiance": 2}], "next_event": "phase",
/// "roulette_from": null, "roulette_floor": 0.05, "most_scatterings": 1, "kernel": "general"}; every key is optional.
TransportSpec read_transport(const JsonNode& node);

/// The inverse, complete.
Json transport_json(const TransportSpec& transport);

/// Differences from the defaults, for names: "environment:1/next_event:phase".
std::string transport_label(const TransportSpec& transport);

/// One number, or a list of one per channel, each >= 0 and at most `most`.
std::vector<Real> read_per_channel(const JsonNode& node, Real most);

Json transport_schema();

}  // namespace nullmark
