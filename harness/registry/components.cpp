#include "harness/registry/components.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <type_traits>

#include "harness/registry/environment_variables.h"

namespace nullmark {
namespace {

/// Writes down what a component tells.  A component may tell a parameter more than once (estimators do, for grey and for
/// chromatic values); the first counts.
class Describe final : public ParameterVisitor {
 public:
  std::vector<ParameterInfo> parameters;

  void number(const char* name, Real& value, Range range, const char* unit, const char* text) override {
    if (ParameterInfo* info = add(name, value, unit, text)) info->range = range;
  }
  void integer(const char* name, int& value, int low, int high, const char* text) override {
    if (ParameterInfo* info = add(name, value, "", text)) {
      info->low = low;
      info->high = high;
    }
  }
  void flag(const char* name, bool& value, const char* text) override { add(name, value, "", text); }
  void choice(const char* name, std::string& value, std::initializer_list<const char*> allowed, const char* text) override {
    if (ParameterInfo* info = add(name, value, "", text)) info->allowed.assign(allowed.begin(), allowed.end());
  }
  void text(const char* name, std::string& value, const char* text) override { add(name, value, "", text); }
  void numbers(const char* name, std::vector<Real>& value, int least, int most, Range range, const char* unit,
               const char* text) override {
    if (ParameterInfo* info = add(name, value, unit, text)) {
      info->range = range;
      info->least = least;
      info->most = most;
    }
  }
  void texts(const char* name, std::vector<std::string>& value, const char* text) override { add(name, value, "", text); }
  void object(const char* name, std::string& value, const char* text) override {
    if (ParameterInfo* info = add(name, value, "", text)) info->object = true;
  }
  void point(const char* name, Vec3& value, const char* unit, const char* text) override {
    add(name, std::array<Real, 3>{value.x(), value.y(), value.z()}, unit, text);
  }

 private:
  ParameterInfo* add(const char* name, ParameterValue value, const char* unit, const char* text) {
    const auto same = [&](const ParameterInfo& info) { return info.name == name; };
    if (std::any_of(parameters.begin(), parameters.end(), same)) return nullptr;
    ParameterInfo info;
    info.name = name;
    info.unit = unit;
    info.text = text;
    info.default_value = std::move(value);
    parameters.push_back(std::move(info));
    return &parameters.back();
  }
};

/// Gives a component's fields the values of a map; what the map leaves out keeps its default.
class Assign final : public ParameterVisitor {
 public:
  explicit Assign(const Component& component) : component_(component) {}

  void number(const char* name, Real& value, Range, const char*, const char*) override { assign(name, value); }
  void integer(const char* name, int& value, int, int, const char*) override { assign(name, value); }
  void flag(const char* name, bool& value, const char*) override { assign(name, value); }
  void choice(const char* name, std::string& value, std::initializer_list<const char*>, const char*) override {
    assign(name, value);
  }
  void text(const char* name, std::string& value, const char*) override {
    assign(name, value);
    value = with_variables(value);
  }
  void numbers(const char* name, std::vector<Real>& value, int, int, Range, const char*, const char*) override {
    assign(name, value);
  }
  void texts(const char* name, std::vector<std::string>& value, const char*) override {
    assign(name, value);
    for (std::string& word : value) word = with_variables(word);
  }
  void object(const char* name, std::string& value, const char*) override { assign(name, value); }
  void point(const char* name, Vec3& value, const char*, const char*) override {
    std::array<Real, 3> point{value.x(), value.y(), value.z()};
    assign(name, point);
    value = Vec3(point[0], point[1], point[2]);
  }

  void refuse_the_rest() const {
    for (const auto& [name, value] : component_.values)
      if (!told_.contains(name)) throw ParameterError(name, fmt::format("{} has no parameter \"{}\"", component_.type, name));
  }

 private:
  template <class Value>
  void assign(const char* name, Value& field) {
    told_.insert(name);
    const auto at = component_.values.find(name);
    if (at == component_.values.end()) return;
    if (const Value* value = std::get_if<Value>(&at->second))
      field = *value;
    else
      throw ParameterError(
          name, fmt::format("{} has another type than {}'s parameter \"{}\"", to_text(at->second), component_.type, name));
  }

  const Component& component_;
  std::set<std::string> told_;
};

template <class Entry>
const Entry& find(ComponentKind kind, std::string_view type) {
  if (const Entry* entry = Registry<Entry>::instance().find(type)) return *entry;
  throw ParameterError("type", fmt::format("unknown {} \"{}\"", to_string(kind), type));
}

template <class Entry>
auto make(ComponentKind kind, const Component& component) {
  auto source = find<Entry>(kind, component.type).make();
  Assign assign(component);
  source->parameters(assign);
  assign.refuse_the_rest();
  return source;
}

/// The folder of the file that names a component.
std::string folder_of(const Component& component) {
  const std::string file = component.pointer.substr(0, component.pointer.find(": /"));
  return std::filesystem::path(file).parent_path().string();
}

template <class Entry>
std::vector<ComponentInfo> entries() {
  std::vector<ComponentInfo> result;
  for (const Entry& entry : Registry<Entry>::instance().entries()) {
    if constexpr (std::is_same_v<Entry, EstimatorEntry>)
      if (entry.planted) continue;
    result.push_back({entry.name, entry.summary, entry.source});
  }
  return result;
}

template <class Entry>
std::vector<ParameterInfo> describe(ComponentKind kind, std::string_view type) {
  Describe describe;
  find<Entry>(kind, type).make()->parameters(describe);
  return std::move(describe.parameters);
}

}  // namespace

const char* to_string(ComponentKind kind) {
  switch (kind) {
    case ComponentKind::estimator:
      return "estimator";
    case ComponentKind::medium:
      return "medium";
    case ComponentKind::majorant:
      return "majorant";
    case ComponentKind::ray_set:
      break;
  }
  return "ray set";
}

std::vector<ComponentInfo> registered(ComponentKind kind) {
  switch (kind) {
    case ComponentKind::estimator:
      return entries<EstimatorEntry>();
    case ComponentKind::medium:
      return entries<MediumEntry>();
    case ComponentKind::majorant:
      return entries<MajorantEntry>();
    case ComponentKind::ray_set:
      break;
  }
  return entries<RaySetEntry>();
}

bool is_planted(std::string_view estimator) {
  const EstimatorEntry* entry = Registry<EstimatorEntry>::instance().find(estimator);
  return entry && entry->planted;
}

std::vector<ParameterInfo> parameters_of(ComponentKind kind, std::string_view type) {
  switch (kind) {
    case ComponentKind::estimator:
      return describe<EstimatorEntry>(kind, type);
    case ComponentKind::medium:
      return describe<MediumEntry>(kind, type);
    case ComponentKind::majorant:
      return describe<MajorantEntry>(kind, type);
    case ComponentKind::ray_set:
      break;
  }
  return describe<RaySetEntry>(kind, type);
}

std::string to_text(const ParameterValue& value) {
  return std::visit(
      [](const auto& held) -> std::string {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, std::vector<Real>> || std::is_same_v<Held, std::array<Real, 3>> ||
                      std::is_same_v<Held, std::vector<std::string>>)
          return fmt::format("{}", fmt::join(held, ","));
        else
          return fmt::format("{}", held);
      },
      value);
}

std::string make_label(const std::string& type, const ParameterValues& values, const std::vector<ParameterInfo>& parameters) {
  if (const auto own = values.find("label"); own != values.end())
    if (const auto* text = std::get_if<std::string>(&own->second); text && !text->empty()) return *text;
  std::string label = type;
  for (const ParameterInfo& parameter : parameters) {
    const auto at = values.find(parameter.name);
    if (at != values.end() && at->second != parameter.default_value)
      label += fmt::format("/{}:{}", parameter.name, to_text(at->second));
  }
  return label;
}

std::unique_ptr<MediumSource> make_medium(const Component& component) {
  return make<MediumEntry>(ComponentKind::medium, component);
}
std::unique_ptr<MajorantSource> make_majorant(const Component& component) {
  return make<MajorantEntry>(ComponentKind::majorant, component);
}
std::unique_ptr<RaySetSource> make_ray_set(const Component& component) {
  return make<RaySetEntry>(ComponentKind::ray_set, component);
}
std::unique_ptr<EstimatorSource> make_estimator(const Component& component) {
  auto source = make<EstimatorEntry>(ComponentKind::estimator, component);
  source->locate(folder_of(component));
  return source;
}

}  // namespace nullmark
