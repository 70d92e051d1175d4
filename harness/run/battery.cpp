#include "harness/run/battery.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

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

/// A bump that varies across the rays, so that a ray's average and bound are not the medium's.
constexpr const char* kAcross =
    R"([{"type": "linear", "begin": 0, "end": 2, "axis": "y", "hi": [1.5, 1, 1]}, {"type": "cosine", "frequency": 6.283185307179586, "phase": 0, "hi": [1.5, 1, 1]}])";

constexpr const char* kChromatic = R"([
  {"type": "homogeneous", "extinction": 0.5, "spectrum": [1, 2, 4], "hi": [1.2, 1, 1]},
  {"type": "linear", "optical_depth": 0.5, "spectrum": [1, 3, 0.2], "lo": [-0.2, 0, 0], "hi": [1.6, 1, 1]},
  {"type": "channels", "media": [{"type": "linear", "optical_depth": 1}, {"type": "cosine", "optical_depth": 0.5}, {"type": "gaussian_bump", "optical_depth": 0.4}]}])";

/// What a cell may cost.
Json budget(bool quick) {
  const Real scale = quick ? 1. / 8 : 1;
  return {{"max_samples_per_ray", 4'000'000 * scale}, {"max_lookups_per_ray", 2e7 * scale}};
}

class BatteryText {
 public:
  BatteryText(const Json& estimator, const Json& medium, bool quick)
      : estimator_(estimator), medium_(medium), quick_(quick), experiments_(Json::array()) {}

  void add(const char* name, const char* media, const char* bounds, const char* rays = kThroughAll, const Json& keys = {}) {
    Json experiment = {{"name", name}, {"samples_per_ray", 4096}, {"verdict", budget(quick_)}};
    experiment["rays"] = known_json(medium_.is_null() ? rays : kOblique);
    Json list = known_json(media);
    if (quick_ && list.size() > kQuickMedia) list.erase(list.begin() + kQuickMedia, list.end());
    experiment["matrix"] = {
        {"estimator", estimator_}, {"medium", medium_.is_null() ? list : medium_}, {"majorant", known_json(bounds)}};
    if (!keys.is_null()) experiment.update(keys);
    experiments_.push_back(std::move(experiment));
  }

  std::string text() const {
    return Json{{kVersionKey, kConfigVersion}, {"name", "prove"}, {"timing", {{"enabled", false}}}, {"experiments", experiments_}}
        .dump();
  }

 private:
  static constexpr std::size_t kQuickMedia = 5;

  Json estimator_, medium_;
  bool quick_;
  Json experiments_;
};

std::string type_of(const Json& estimator) {
  if (estimator.is_string()) return estimator.get<std::string>();
  return estimator.is_object() && estimator.contains("type") && estimator["type"].is_string()
             ? estimator["type"].get<std::string>()
             : "";
}

std::string battery_text(const Json& estimator, const Json& medium, bool quick) {
  const EstimatorEntry* entry = Registry<EstimatorEntry>::instance().find(type_of(estimator));
  if (!entry) {
    std::vector<std::string> names;
    for (const ComponentInfo& one : registered(ComponentKind::estimator)) names.push_back(one.name);
    const std::string near = nearest(type_of(estimator), names);
    throw InputError(
        fmt::format("unknown estimator \"{}\"{}", type_of(estimator),
                    near.empty() ? "; `nullmark list estimators` lists them" : fmt::format("; did you mean \"{}\"?", near)));
  }
  const std::unique_ptr<EstimatorSource> source = entry->make();
  BatteryText battery(estimator, medium, quick);
  for (const Quantity quantity : entry->quantities) {
    if (source->claim(quantity) == Guarantee::biased || quantity == Quantity::radiance) continue;
    const std::string word = to_string(quantity);
    const Json keys = {{"quantity", word}};
    battery.add(word.c_str(), kMedia, kBounds, kThroughAll, keys);
    if (!medium.is_null()) continue;
    battery.add((word + ", across the rays").c_str(), kAcross, R"([{"type": "global", "looseness": [1, 2]}])", kOblique, keys);
    battery.add((word + ", channels").c_str(), kChromatic,
                R"(["global", {"type": "global", "looseness": 2}, {"type": "grid", "resolution": 4}])",
                R"({"type": "single", "from": [-1, 0.5, 0.5], "to": [2, 0.4, 0.6]})", keys);
    battery.add((word + ", loose bounds").c_str(), R"([{"type": "homogeneous", "extinction": 0.8, "hi": [1.25, 1, 1]}])",
                R"([{"type": "global", "looseness": [10, 50]}])", kThroughAll, keys);
    battery.add(
        (word + ", thin and deep").c_str(),
        R"([{"type": "linear", "begin": 0.5, "end": 1.5, "optical_depth": [0.1, 3, 6], "lo": [-0.3, 0, 0], "hi": [1.4, 1, 1]}])",
        R"(["global", {"type": "grid", "resolution": 6}])",
        R"({"type": "single", "from": [-0.5, 0.5, 0.5], "to": [2, 0.5, 0.5]})", keys);
    if (!source->needs_bound())
      battery.add(
          (word + ", bounds that are too low").c_str(),
          R"([{"type": "homogeneous", "extinction": 1, "hi": [1.25, 1, 1]}, {"type": "linear", "begin": 0.5, "end": 2.5, "lo": [-0.2, 0, 0], "hi": [0.9, 1, 1]}])",
          R"([{"type": "global", "looseness": [0.9, 0.05]}])", kThroughAll, keys);
    if (entry->in_lanes) {
      battery.add((word + ", single precision").c_str(),
                  R"([{"type": "linear", "begin": 1, "end": 0, "optical_depth": 2, "lo": [-0.2, 0, 0], "hi": [1.4, 1, 1]}])",
                  R"(["global", {"type": "grid", "resolution": 5}])", kThroughAll, {{"quantity", word}, {"precision", "float"}});
      battery.add((word + ", one walk at a time").c_str(),
                  R"([{"type": "linear", "begin": 1, "end": 0, "optical_depth": 2, "lo": [-0.2, 0, 0], "hi": [1.4, 1, 1]}])",
                  R"([{"type": "grid", "resolution": 5}])", kThroughAll, {{"quantity", word}, {"lanes", false}});
    }
  }
  return battery.text();
}

}  // namespace

Battery make_battery(const Json& estimator, const Json& medium, bool quick) {
  const std::string text = battery_text(estimator, medium, quick);
  if (known_json(text)["experiments"].empty())
    throw InputError(fmt::format("\"{}\" claims nothing that can be proven", type_of(estimator)));
  Battery battery;
  battery.plan = read_config(text, "prove");
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
