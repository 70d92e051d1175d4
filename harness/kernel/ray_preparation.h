#pragma once

#include "harness/kernel/estimator_traits.h"
#include "media/base/inversion.h"
#include "media/base/medium.h"

namespace nullmark {

/// Fills a tracker's data of a ray, but for what its loop finds in its own way: `bounds`, `exact_depth` and `knots`, which must
/// be there, and `albedo`, which is set to 0.  `world` and `local` are cut to the medium; `local` and `extrema` must outlive the
/// walks.  Then the tracker's `prepare` may follow.
template <class Traits, class RayData>
void prepare_ray(RayData& ray, const Medium& medium, const Extrema& extrema, const Ray& world, const Ray& local, int channels) {
  ray.begin = world.begin;
  ray.end = world.end;
  ray.entry = world.at(world.begin);
  ray.channels = channels;
  ray.medium = &extrema;
  if constexpr (Traits::kNeedsKnots) ray.degree = medium.polynomial_degree();
  ray.bounds.start_rates(ray.begin, ray.majorant);
  // These may ask for the rate before a flight has found it.
  if constexpr (Traits::kIgnoresMajorant || Traits::kOwnFlights) ray.majorant.has(0);
  if constexpr (Traits::kNeedsInversion)
    // Two pointers fit std::function's own memory; a ray would be allocated for every leg of a path.
    ray.distance_at_depth = [&medium, along = &local](Real depth) { return distance_at_depth(medium, *along, depth); };
  if constexpr (Traits::kNeedsShares) {
    ray.shares.clear();
    for (const Segment& segment : ray.bounds.segments()) {
      const Vec3 a = local.at(segment.begin), b = local.at(segment.end);
      Spectrum bounds = medium.component_maxima({a.cwiseMin(b), a.cwiseMax(b)});
      if (!(bounds.sum() > 0)) bounds.setOnes();
      ray.shares.push_back(bounds / bounds.sum());
    }
  }
  ray.set_albedo(ray.value(0), nullptr, world);
  ray.throughput = ray.value(1);
}

}  // namespace nullmark
