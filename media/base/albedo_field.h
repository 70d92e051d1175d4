#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "media/base/value.h"

namespace nullmark {

/// mu_s / mu where it differs from point to point: a field of its own, or what the components of a sum scatter.  Points are world
/// points; a read of it belongs to the lookup of the extinction there.  Immutable.
class AlbedoField {
 public:
  virtual ~AlbedoField() = default;

  /// In [0, 1], for every channel of the medium.
  virtual void at(const Vec3& point, int channels, Real* out) const = 0;

  /// Bounds over the medium, per channel.
  virtual Spectrum least(int channels) const = 0;
  virtual Spectrum most(int channels) const = 0;

  /// Lower bounds of mu_a and mu_s over a medium whose extinction has this least value.
  virtual Spectrum least_absorption(const Spectrum& extinction) const {
    return extinction * (1 - most(static_cast<int>(extinction.size())));
  }
  virtual Spectrum least_scattering(const Spectrum& extinction) const {
    return extinction * least(static_cast<int>(extinction.size()));
  }

  /// Distances along a world ray at which it jumps or bends, as those of a medium.
  virtual void knots(const Ray& world, std::vector<Real>& t) const = 0;

  virtual std::uint64_t content_hash() const { return 0; }
};

/// The albedo at a world point, as a Value.
template <class Value>
Value albedo_at(const AlbedoField& field, const Vec3& point, int channels) {
  std::array<Real, static_cast<std::size_t>(kMostChannels<Value>)> out;
  field.at(point, channels, out.data());
  return load<Value>(out.data(), channels);
}

}  // namespace nullmark
