#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimators/walk/event_choice.h"
#include "estimators/walk/flight.h"
#include "media/base/albedo_field.h"
#include "media/base/value.h"
#include "media/majorants/ray_bounds.h"

namespace nullmark {

/// One ray's way through the medium, as all walks of a block share it.
template <class Value>
struct MediumRay {
  Real begin = 0, end = 0;  ///< world lengths
  int channels = 1;
  Rates majorant;                    ///< one piece per segment, the majorant of the largest channel
  RayBounds bounds;                  ///< extrema per segment
  const Extrema* medium = nullptr;   ///< over the whole medium
  std::optional<Value> exact_depth;  ///< tau in closed form or by exact traversal; only for estimators with kNeedsOpticalDepth
  std::vector<Real> knots;           ///< sorted, begin and end included; only for estimators with kNeedsKnots
  std::optional<int> degree;         ///< of the extinction between knots, with kNeedsKnots
  Vec3 entry = Vec3::Zero();         ///< world point at `begin`
  Value albedo;                      ///< mu_s / mu, in [0, 1]; 0 where nothing scatters; its most where it varies in space
  const AlbedoField* albedo_field = nullptr;  ///< where it varies
  Ray along;                                  ///< in the world; only with `albedo_field`
  std::function<Real(Real)>
      distance_at_depth;         ///< of grey media with closed-form depth; only for estimators with kNeedsInversion
  Value throughput;              ///< of the path before this flight, 1 where it begins; for trackers that heed the past
  std::vector<Spectrum> shares;  ///< per segment: bounds of a sum's components over their sum; only with kNeedsShares
  bool draws_absorption = true;  ///< false: absorption is left to weights (E[w; collision] = mu_s T dt), since nothing emits

  Real length() const { return end - begin; }

  /// mu_s / mu at a distance.
  Value albedo_at(Real t) const { return albedo_field ? read_albedo(t) : albedo; }

  /// mu_a, mu_s and mub - mu at a distance, or at those of many walks.
  template <class Extinction>
  [[gnu::always_inline]] Coefficients<Extinction> coefficients(const Extinction& extinction, const Distance<Extinction>& t,
                                                               const Distance<Extinction>& mub) const {
    if (albedo_field) return {extinction, values_at<Extinction>(t, [&](Real x) { return read_albedo(x); }), mub};
    return {extinction, Extinction(albedo), mub};
  }

  void set_albedo(const Value& most, const AlbedoField* field, const Ray& world) {
    albedo = most;
    albedo_field = field;
    if (field) along = world;
  }
  Value value(Real x) const { return uniform_value<Value>(channels, x); }

 private:
  [[gnu::noinline]] Value read_albedo(Real t) const { return nullmark::albedo_at<Value>(*albedo_field, along.at(t), channels); }
};

}  // namespace nullmark
