#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "harness/model/plan.h"
#include "harness/registry/estimator_entry.h"
#include "harness/registry/ray_sets.h"
#include "media/base/registry.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// The four registries of components that a configuration can name.
enum class ComponentKind { estimator, medium, majorant, ray_set };

/// "estimator", "medium", "majorant" or "ray set".
const char* to_string(ComponentKind kind);

/// Description of one parameter of a component.  The type of the default is the type of the parameter; a choice is a string with
/// a non-empty `allowed`.
struct ParameterInfo {
  std::string name, unit, text;
  ParameterValue default_value;
  Range range;                       ///< numbers: range of each
  int low = 0, high = 0;             ///< integer: both included
  std::vector<std::string> allowed;  ///< choice
  bool object = false;               ///< string: it holds a JSON object
  int least = 0, most = 0;           ///< numbers: how many
};

/// Description of a registered component.
struct ComponentInfo {
  std::string name, summary, source;
};

/// Sorted by name, without planted bugs.
std::vector<ComponentInfo> registered(ComponentKind kind);

/// Whether an estimator can be named although `registered` leaves it out.
bool is_planted(std::string_view estimator);

/// In declared order.  Throws ParameterError for a type that is not registered.
std::vector<ParameterInfo> parameters_of(ComponentKind kind, std::string_view type);

/// The type and the parameters that differ from their defaults, in declared order: "residual_ratio/control:average".  A parameter
/// "label", which trackers from outside have, is the label itself.
std::string make_label(const std::string& type, const ParameterValues& values, const std::vector<ParameterInfo>& parameters);

/// "0.5", "true", "1,2,3" or the text itself; the shortest form that gives the same number when read.
std::string to_text(const ParameterValue& value);

/// Build a component's registered source and assign its parameters.  ${NULLMARK_...} in text parameters is replaced by the
/// environment variable here, so labels and ids do not contain its value.  Throw ParameterError for an unknown type or parameter
/// or a value of another type, MissingData for a variable that is not set.
std::unique_ptr<MediumSource> make_medium(const Component& component);
std::unique_ptr<MajorantSource> make_majorant(const Component& component);
std::unique_ptr<RaySetSource> make_ray_set(const Component& component);
std::unique_ptr<EstimatorSource> make_estimator(const Component& component);

}  // namespace nullmark
