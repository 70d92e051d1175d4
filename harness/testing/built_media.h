#pragma once

#include <memory>
#include <utility>

#include "media/base/field.h"
#include "media/homogeneous.h"
#include "media/linear.h"

namespace nullmark {

// Media made without a configuration, for tests.

template <class Field>
std::shared_ptr<const Medium> built(Field field) {
  if constexpr (requires { field.prepare(); }) field.prepare();
  return std::make_shared<FieldMedium<Field>>(std::move(field));
}

inline std::shared_ptr<const Medium> constant(Real extinction) {
  Homogeneous field;
  field.value = extinction;
  return built(field);
}

/// From `begin` to `end` along x, scaled to an optical depth where one is given.
inline std::shared_ptr<const Medium> linear(Real begin, Real end, Real depth = 0) {
  Linear field;
  field.profile = {begin, end};
  field.target_depth = depth;
  return built(field);
}

}  // namespace nullmark
