#include "harness/io/cell_texts.h"

#include <fmt/format.h>

#include "harness/io/spec_fields.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/hash.h"
#include "harness/model/names.h"

namespace nullmark {

template <class Part>
const std::string& CellTexts::shared(const Part& part, Json (*to_json)(const Part&)) {
  const auto [at, added] = shared_.try_emplace(&part);
  if (added) at->second = to_json(part).dump();
  return at->second;
}

const std::string& CellTexts::component(const Component& part) { return shared(part, component_json); }

std::string CellTexts::id(const Cell& cell) {
  return fmt::format("{:016x}", fnv1a(deciding(cell, shared(*plan_.media[cell.medium], medium_json)) + "}"));
}

std::string CellTexts::applied(const Cell& cell) {
  std::string medium = shared(*plan_.media[cell.medium], medium_json);
  if (plan_.media[cell.medium]->optional) medium.replace(medium.size() - 1, 1, R"(,"optional":true})");
  std::string text = deciding(cell, medium);
  text += fmt::format(R"(,"images":{},"image_maximum":{},"verdict":{})", cell.images, Json(cell.image_maximum).dump(),
                      verdict_.text(cell.verdict, fields_json<VerdictSpec>));
  if (cell.reference) text += fmt::format(R"(,"reference":{})", reference_.text(*cell.reference, fields_json<GivenReference>));
  return text + "}";
}

std::string CellTexts::deciding(const Cell& cell, const std::string& medium) {
  std::string text = fmt::format(R"({{"estimator":{},"medium":{},"majorant":{},"rays":{},"quantity":"{}","measurement":{})",
                                 component(*cell.estimator), medium, component(*plan_.majorants[cell.majorant]),
                                 component(*plan_.ray_sets[cell.rays]), to_string(cell.quantity),
                                 measurement_.text(cell.measurement, fields_json<Measurement>));
  if (cell.minus) text += fmt::format(R"(,"minus":{})", component(**cell.minus));
  if (cell.transport != TransportSpec{})
    text += fmt::format(R"(,"transport":{})", transport_.text(cell.transport, transport_json));
  if (cell.precision != Precision::float64) text += fmt::format(R"(,"precision":"{}")", to_string(cell.precision));
  if (!cell.lanes) text += R"(,"lanes":false)";
  text += cell.equal_lookups ? fmt::format(R"(,"equal_lookups":{})", Json(*cell.equal_lookups).dump())
                             : fmt::format(R"(,"samples_per_ray":{})", cell.samples_per_ray);
  return text + fmt::format(R"(,"seed":{},"own_streams":{})", cell.seed, cell.own_streams);
}

}  // namespace nullmark
