#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "harness/cli/commands.h"
#include "harness/config/schema.h"
#include "harness/io/fitted.h"
#include "harness/io/notice.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

const std::vector<std::pair<Quantity, const char*>> kSummaries = {
    {Quantity::transmittance, "T = exp(-tau) along each ray"},
    {Quantity::optical_depth, "tau, the integral of extinction along each ray"},
    {Quantity::transmittance_profile, "T up to 8 distances of each ray, from one walk"},
    {Quantity::free_path, "how a flight along each ray ends: where it collides, scatters or escapes, and with what weight"},
    {Quantity::radiance, "light that arrives along each ray, absorbed, scattered and emitted on its way"}};

Json parameters_list(ComponentKind kind, const std::string& type) {
  Json list = Json::array();
  for (const ParameterInfo& parameter : parameters_of(kind, type)) {
    Json entry = {{"name", parameter.name}};
    entry.update(parameter_schema(parameter));
    entry["description"] = parameter.text;
    if (!parameter.unit.empty()) entry["unit"] = parameter.unit;
    list.push_back(std::move(entry));
  }
  return list;
}

void add_traits(const std::string& name, Json& json) {
  const EstimatorEntry& entry = *Registry<EstimatorEntry>::instance().find(name);
  // Its claims are those of the code that it runs.
  if (entry.foreign) return;
  const std::unique_ptr<EstimatorSource> source = entry.make();
  Json claims = Json::object();
  for (const Quantity quantity : entry.quantities) claims[to_string(quantity)] = to_string(source->claim(quantity));
  json["claims"] = std::move(claims);
  json["range"] = to_string(entry.range);
  json["needs_bound"] = entry.needs_bound;
  json["grey_only"] = source->kernel(3) == nullptr;
  json["lanes"] = entry.in_lanes;
  json["precisions"] = Json::array({to_string(Precision::float64)});
  if (entry.in_lanes) json["precisions"].push_back(to_string(Precision::float32));
}

Json component_list(ComponentKind kind) {
  Json list = Json::array();
  for (const ComponentInfo& entry : registered(kind)) {
    Json json = {{"name", entry.name}, {"summary", entry.summary}, {"source", entry.source}};
    if (kind == ComponentKind::estimator) add_traits(entry.name, json);
    json["parameters"] = parameters_list(kind, entry.name);
    list.push_back(std::move(json));
  }
  return list;
}

std::string plain(const Json& json) { return json.is_string() ? json.get<std::string>() : json.dump(); }

std::string range_text(const Json& parameter) {
  if (parameter.contains("enum")) {
    std::string text;
    for (const Json& name : parameter["enum"]) text += (text.empty() ? "" : " | ") + name.get<std::string>();
    return text;
  }
  std::string text;
  const Json& of = parameter.contains("items") ? parameter["items"] : parameter;
  for (const auto& [key, sign] : {std::pair{"minimum", ">="}, std::pair{"exclusiveMinimum", ">"}, std::pair{"maximum", "<="}})
    if (of.contains(key)) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", sign, of[key].dump());
  return text;
}

void print_text(const Json& list) {
  const std::size_t width = terminal_width();
  const auto tell_line = [&](const std::string& line) { tell("{}", wrapped(line, width)); };
  for (const Json& entry : list) {
    tell_line(fmt::format("{}\n    {}\n", plain(entry["name"]), plain(entry["summary"])));
    if (entry.contains("source") && entry["source"] != "") tell_line(fmt::format("    source: {}\n", plain(entry["source"])));
    if (entry.contains("claims")) {
      std::string claims;
      for (const auto& [quantity, claim] : entry["claims"].items())
        claims += fmt::format("{}{}: {}", claims.empty() ? "" : ", ", quantity, plain(claim));
      tell_line(fmt::format("    {}; range of samples: {}{}{}{}\n", claims, plain(entry["range"]),
                            entry["grey_only"].get<bool>() ? "; takes grey media only" : "",
                            entry["needs_bound"].get<bool>() ? "; needs a majorant that bounds the extinction" : "",
                            entry["lanes"].get<bool>() ? "; runs in lanes, in double and in float" : ""));
    }
    if (!entry.contains("parameters")) continue;
    for (const Json& parameter : entry["parameters"]) {
      const std::string unit = parameter.contains("unit") ? fmt::format(" {}", plain(parameter["unit"])) : "";
      const std::string range = range_text(parameter);
      tell_line(fmt::format("    {} = {}{}{}: {}\n", plain(parameter["name"]), parameter["default"].dump(), unit,
                            range.empty() ? "" : fmt::format(" ({})", range), plain(parameter["description"])));
    }
  }
}

}  // namespace

ExitCode list_command(const ListCommand& command) {
  Json list = Json::array();
  if (command.what == "estimators") list = component_list(ComponentKind::estimator);
  if (command.what == "media") list = component_list(ComponentKind::medium);
  if (command.what == "majorants") list = component_list(ComponentKind::majorant);
  if (command.what == "rays") list = component_list(ComponentKind::ray_set);
  if (command.what == "quantities")
    for (const auto& [quantity, summary] : kSummaries) list.push_back({{"name", to_string(quantity)}, {"summary", summary}});
  if (!command.name.empty()) {
    std::vector<std::string> names;
    for (const Json& entry : list) names.push_back(plain(entry["name"]));
    const auto at = std::find(names.begin(), names.end(), command.name);
    if (at == names.end()) {
      const std::string near = nearest(command.name, names);
      throw InputError(fmt::format(
          "list {}: found \"{}\"; {}", command.what, command.name,
          near.empty() ? fmt::format("`list {}` shows all of them", command.what) : fmt::format("did you mean \"{}\"?", near)));
    }
    list = Json::array({list[static_cast<std::size_t>(at - names.begin())]});
  }
  if (command.json)
    fmt::print("{}\n", list.dump(2));
  else
    print_text(list);
  return ExitCode::ok;
}

}  // namespace nullmark
