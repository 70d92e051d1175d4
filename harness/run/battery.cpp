#include "harness/run/battery.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "harness/config/component_reader.h"
#include "harness/config/config.h"
#include "harness/io/spec_json.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"
#include "harness/sampling/cell_preparation.h"

namespace nullmark {
namespace {

/// Through all media below from outside; it begins in none of them.
constexpr const char* kThroughAll = R"({"type": "single", "from": [-0.4, 0.1, 0.3], "to": [2, 0.9, 0.6]})";
/// The same for a medium that is not known beforehand.
constexpr const char* kOblique =
    R"({"type": "perspective", "width": 4, "height": 4, "view": [-1, -0.4, -0.3], "up": [0, 0, 1], "distance": 2, "field_of_view": 6})";

constexpr const char* kMedia = R"([
  {"type": "homogeneous", "extinction": [0.4, 2], "hi": [1.75, 1, 1]},
  {"type": "linear", "begin": 1, "end": 0, "optical_depth": 2, "lo": [-0.2, 0, 0], "hi": [1.4, 1, 1]},
  {"type": "linear", "begin": 0, "end": 1, "optical_depth": 1, "lo": [0.2, 0, 0], "hi": [0.8, 1, 1]},
  {"type": "layers", "values": [[0.2, 3, 0, 1]], "lo": [0.1, 0, 0], "hi": [1.2, 1, 1]},
  {"type": "fractal_noise", "peak": 6, "octaves": 3, "lo": [-0.2, 0, 0], "hi": [1.1, 1, 1]},
  {"type": "polynomial", "coefficients": [[0.2, 1, 0.5], [1, -1, 0.5, 0.2]], "hi": [1.3, 1, 1]},
  {"type": "exponential", "amplitude": 3, "rate": -3, "lo": [0.4, 0, 0], "hi": [1.5, 1, 1]},
  {"type": "cosine", "optical_depth": 0.7, "hi": [1.6, 1, 1]},
  {"type": "gaussian_bump", "optical_depth": 0.7, "lo": [0.1, 0, 0], "hi": [1.8, 1, 1]},
  {"type": "gaussian_hole", "optical_depth": 0.7, "lo": [-0.1, 0, 0], "hi": [0.4, 1, 1]},
  {"type": "checkerboard", "hi": [1.5, 1, 1]}])";

constexpr const char* kBounds =
    R"(["global", {"type": "global", "looseness": [2, 5]}, {"type": "grid", "resolution": 5}, {"type": "grid", "resolution": 4, "resolution_y": 1, "resolution_z": 1}, {"type": "kd_tree", "resolution": 16, "forced_depth": 4}])";

constexpr const char* kChromatic = R"([
  {"type": "homogeneous", "extinction": 0.5, "spectrum": [1, 2, 4], "hi": [1.2, 1, 1]},
  {"type": "linear", "optical_depth": 0.5, "spectrum": [1, 3, 0.2], "lo": [-0.2, 0, 0], "hi": [1.6, 1, 1]},
  {"type": "channels", "media": [{"type": "linear", "optical_depth": 1}, {"type": "cosine", "optical_depth": 0.5}, {"type": "gaussian_bump", "optical_depth": 0.4}]}])";

/// When a group of scenes is of use.
enum class When { always, bound_not_needed, in_lanes };

/// Scenes that put one thing to the test.
struct SceneGroup {
  const char* name;
  const char* media;
  const char* bounds;
  const char* rays;
  const char* keys = "{}";  ///< further keys of the experiment
  When when = When::always;
};

constexpr const char* kFalling =
    R"([{"type": "linear", "begin": 1, "end": 0, "optical_depth": 1, "lo": [-0.2, 0, 0], "hi": [1.4, 1, 1]}])";

constexpr SceneGroup kGroups[] = {
    {"", kMedia, kBounds, kThroughAll},
    // A ray's average and bound are not the medium's.
    {", across the rays",
     R"([{"type": "linear", "begin": 0, "end": 2, "axis": "y", "hi": [1.5, 1, 1]},
         {"type": "cosine", "frequency": 6.283185307179586, "phase": 0, "hi": [1.5, 1, 1]}])",
     R"([{"type": "global", "looseness": [1, 2]}])", kOblique},
    {", some rays miss", kFalling, R"(["global", {"type": "grid", "resolution": 5}])",
     R"({"type": "perspective", "width": 4, "height": 4, "view": [-1, -0.4, -0.3], "up": [0, 0, 1], "distance": 2, "field_of_view": 60})"},
    {", channels", kChromatic, R"(["global", {"type": "global", "looseness": 2}, {"type": "grid", "resolution": 4}])",
     R"({"type": "single", "from": [-1, 0.5, 0.5], "to": [2, 0.4, 0.6]})"},
    {", loose bounds", R"([{"type": "homogeneous", "extinction": 0.8, "hi": [1.25, 1, 1]}])",
     R"([{"type": "global", "looseness": [10, 50]}])", kThroughAll},
    {", thin and deep",
     R"([{"type": "linear", "begin": 0.5, "end": 1.5, "optical_depth": [0.1, 3, 6], "lo": [-0.3, 0, 0], "hi": [1.4, 1, 1]}])",
     R"(["global", {"type": "grid", "resolution": 6}])", R"({"type": "single", "from": [-0.5, 0.5, 0.5], "to": [2, 0.5, 0.5]})"},
    {", bounds that are too low",
     R"([{"type": "homogeneous", "extinction": 1, "hi": [1.25, 1, 1]},
         {"type": "linear", "begin": 0.5, "end": 2.5, "lo": [-0.2, 0, 0], "hi": [0.9, 1, 1]}])",
     R"([{"type": "global", "looseness": [0.9, 0.05]}])", kThroughAll, "{}", When::bound_not_needed},
    {", single precision", kFalling, R"(["global", {"type": "grid", "resolution": 5}])", kThroughAll, R"({"precision": "float"})",
     When::in_lanes},
    {", one walk at a time", kFalling, R"([{"type": "grid", "resolution": 5}])", kThroughAll, R"({"lanes": false})",
     When::in_lanes}};

/// For every other value of a parameter that is a choice.
constexpr SceneGroup kOfChoices = {", choices",
                                   R"([{"type": "linear", "begin": 0, "end": 0.8, "lo": [-0.2, 0, 0], "hi": [1.1, 1, 1]},
        {"type": "layers", "values": [[0.2, 3, 0, 1]], "lo": [0.1, 0, 0], "hi": [1.2, 1, 1]},
        {"type": "homogeneous", "extinction": 0.5, "spectrum": [1, 2, 4], "hi": [1.2, 1, 1]}])",
                                   R"([{"type": "global", "looseness": [1, 2]}, {"type": "grid", "resolution": 5}])",
                                   kThroughAll};

/// What a cell must prove and may cost.  A wide epsilon is decided soon; a bias below it is still a FAIL where it is proven.
Json budget(bool quick) {
  if (quick) return {{"epsilon", 0.03}, {"max_samples_per_ray", 500'000}, {"max_lookups_per_ray", 2'500'000}};
  return {{"max_samples_per_ray", 4'000'000}, {"max_lookups_per_ray", 20'000'000}};
}

std::string type_of(const Json& estimator) {
  if (estimator.is_string()) return estimator.get<std::string>();
  return estimator.is_object() && estimator.contains("type") && estimator["type"].is_string()
             ? estimator["type"].get<std::string>()
             : "";
}

const EstimatorEntry& entry_of(const std::string& type) {
  if (const EstimatorEntry* entry = Registry<EstimatorEntry>::instance().find(type)) return *entry;
  std::vector<std::string> names;
  for (const ComponentInfo& one : registered(ComponentKind::estimator)) names.push_back(one.name);
  const std::string near = nearest(type, names);
  throw InputError(fmt::format("unknown estimator \"{}\"{}", type,
                               type.find('/') != std::string::npos
                                   ? "; parameters are given as JSON: {\"type\": \"...\", \"steps\": 8}"
                               : near.empty() ? "; `nullmark list estimators` lists them"
                                              : fmt::format("; did you mean \"{}\"?", near)));
}

/// The tracker with each other value of each parameter that is a choice, one at a time.
Json choices_of(const std::string& type) {
  Json list = Json::array();
  for (const ParameterInfo& parameter : parameters_of(ComponentKind::estimator, type))
    for (const std::string& value : parameter.allowed)
      if (parameter.default_value != ParameterValue(value)) list.push_back({{"type", type}, {parameter.name, value}});
  return list;
}

Json experiment_of(Quantity quantity, const SceneGroup& group, const Json& estimator, const Json& medium, bool quick) {
  constexpr std::size_t kQuickMedia = 5;
  Json media = medium.is_null() ? known_json(group.media) : medium;
  if (medium.is_null() && quick && media.size() > kQuickMedia) media.erase(media.begin() + kQuickMedia, media.end());
  Json experiment = {{"name", to_string(quantity) + group.name},
                     {"quantity", to_string(quantity)},
                     {"rays", known_json(medium.is_null() ? group.rays : kOblique)},
                     {"samples_per_ray", 4096},
                     {"verdict", budget(quick)},
                     {"matrix", {{"estimator", estimator}, {"medium", media}, {"majorant", known_json(group.bounds)}}}};
  experiment.update(known_json(group.keys));
  return experiment;
}

Json battery_json(const Json& estimator, const Json& medium, bool quick) {
  const EstimatorEntry& entry = entry_of(type_of(estimator));
  // What a tracker from outside is, only its parameters tell.
  const std::unique_ptr<EstimatorSource> source =
      entry.foreign ? make_estimator(read_components(ComponentKind::estimator, JsonNode(estimator, "prove")).front())
                    : entry.make();
  const std::unique_ptr<const Kernel> opened = entry.foreign ? source->kernel(1) : nullptr;
  const auto of_use = [&](When when) {
    return when == When::always || (when == When::in_lanes ? entry.in_lanes : !source->needs_bound());
  };
  Json experiments = Json::array();
  for (const Quantity quantity : entry.quantities) {
    if (opened && !opened->answers(quantity)) continue;
    if (source->claim(quantity) == Guarantee::biased || quantity == Quantity::radiance) continue;
    for (const SceneGroup& group : kGroups)
      if (of_use(group.when) && (medium.is_null() || &group == kGroups))
        experiments.push_back(experiment_of(quantity, group, estimator, medium, quick));
    if (const Json choices = choices_of(entry.name); medium.is_null() && estimator.is_string() && !choices.empty())
      experiments.push_back(experiment_of(quantity, kOfChoices, choices, medium, quick));
  }
  return {{kVersionKey, kConfigVersion}, {"name", "prove"}, {"timing", {{"enabled", false}}}, {"experiments", experiments}};
}

}  // namespace

Battery make_battery(const Json& estimator, const Json& medium, bool quick) {
  const Json config = battery_json(estimator, medium, quick);
  if (config["experiments"].empty())
    throw InputError(fmt::format("\"{}\" claims nothing that can be proven", type_of(estimator)));
  Battery battery;
  battery.plan = read_config(config.dump(), "prove");
  battery.selected.assign(battery.plan.cells.size(), true);
  std::map<std::string, std::pair<bool, std::string>> experiments;  // whether any cell is selected, and why not
  CellPreparer preparer(battery.plan);
  for (std::size_t i = 0; i < battery.plan.cells.size(); ++i) {
    auto& [any, reason] = experiments[battery.plan.cells[i].experiment];
    try {
      const PreparedCell prepared = preparer.prepare(i);
      battery.selected[i] = prepared.reason.empty();
      reason = prepared.reason;
    } catch (const ParameterError& error) {
      battery.selected[i] = false;
      reason = error.what();
    }
    any |= battery.selected[i];
  }
  for (const auto& [name, found] : experiments)
    if (!found.first) battery.left_out.push_back(fmt::format("{}: {}", name, found.second));
  if (std::none_of(battery.selected.begin(), battery.selected.end(), [](bool one) { return one; }))
    throw InputError(fmt::format("no scene fits \"{}\": {}", type_of(estimator), fmt::format("{}", battery.left_out.front())));
  return battery;
}

}  // namespace nullmark
