#pragma once

#include <memory>

#include "media/base/medium.h"
#include "media/base/parameters.h"
#include "media/base/value.h"

namespace nullmark {

/// What a medium emits: radiance L_e per channel, such that a ray gains mu_a(x) L_e(x) per length.  Constant, or a grey field f
/// times the factors `radiance`: L_e(x) = radiance f(x), zero outside the field's box.  A field is any grey medium whose
/// extinction serves as a scalar, as a grid of heat beside one of density.
struct Emission {
  Spectrum radiance;                    ///< >= 0 per channel; empty: nothing is emitted
  std::shared_ptr<const Medium> field;  ///< null: constant

  /// Throws ParameterError where the parts do not fit each other or the medium's number of channels.
  void check(int channels) const {
    if (radiance.size() == 0) return;
    if (radiance.size() != channels)
      throw ParameterError("emission",
                           "found " + std::to_string(radiance.size()) + " channels; the medium has " + std::to_string(channels));
    if (!(radiance >= 0).all() || !radiance.isFinite().all())
      throw ParameterError("emission", "found a negative or infinite radiance; expected finite numbers >= 0");
    if (field && field->channels() != 1)
      throw ParameterError("emission",
                           "found a field of several channels; expected a grey one, scaled per channel by the radiance");
  }

  bool any() const { return radiance.size() > 0 && radiance.maxCoeff() > 0; }

  /// L_e at a world point.  `lookups` counts reads of the field.
  template <class Value>
  Value at(const Vec3& world, int channels, std::uint64_t& lookups) const {
    if (radiance.size() == 0) return uniform_value<Value>(channels, 0);
    Value constant = load<Value>(radiance.data(), channels);
    if (!field) return constant;
    const Vec3 p = field->world_to_local() * world;
    const Box box = field->bounds();
    if ((p.array() < box.lo.array()).any() || (p.array() > box.hi.array()).any()) return uniform_value<Value>(channels, 0);
    Real factor = 0;
    field->extinction({&p.x(), &p.y(), &p.z(), 1}, &factor);
    ++lookups;
    return constant * factor;
  }
};

/// Radiance that reaches the scene from infinity, the same from every direction.
struct Environment {
  Spectrum radiance;  ///< >= 0 per channel; empty: black

  bool any() const { return radiance.size() > 0 && radiance.maxCoeff() > 0; }
};

/// A radiance that may be left out, as a Value.
template <class Value>
Value radiance_or_black(const Spectrum& radiance, int channels) {
  return radiance.size() > 0 ? load<Value>(radiance.data(), channels) : uniform_value<Value>(channels, 0);
}

}  // namespace nullmark
