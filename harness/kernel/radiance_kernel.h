#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "harness/kernel/kernel.h"
#include "harness/kernel/transport_scene.h"

namespace nullmark {

/// A ray from a point of the scene up to a surface, and the part of it inside the medium, which begins at 0.
struct Sight {
  Ray world, local;
  SurfaceHit hit;
};

/// Location of the medium.
struct MediumFrame {
  explicit MediumFrame(const Medium& medium) : to_local(medium.world_to_local()), bounds(medium.bounds()) {}

  void look(Ray ray, std::span<const Surface> surfaces, Sight& out) const {
    const SurfaceHit hit = first_hit(surfaces, ray);
    ray.end = std::min(ray.end, hit.distance);
    look(ray, out);
    out.hit = hit;
  }

  // Inlined: a call would read the ray in pairs of numbers that were stored one by one, and such a read waits for both stores.
  [[gnu::always_inline]] void look(const Ray& ray, Sight& out) const {
    out.hit = {};
    const Ray local = transformed(ray, to_local);
    const RayPart part = part_inside(bounds, local);
    start_at(part, ray, out.world);
    start_at(part, local, out.local);
  }

  Affine to_local;
  Box bounds;

 private:
  // Number by number: a copy of a whole ray waits until its single numbers are in memory.
  static void start_at(const RayPart& part, const Ray& ray, Ray& out) {
    for (int axis = 0; axis < 3; ++axis) {
      out.origin[axis] = ray.origin[axis] + part.begin * ray.direction[axis];
      out.direction[axis] = ray.direction[axis];
    }
    out.begin = 0;
    out.end = part.end - part.begin;
  }
};

inline Ray camera_ray(const PreparedRay& context) { return {context.world.origin, context.world.direction, 0, kInfinity}; }

inline Spectrum or_black(const Spectrum& radiance, int channels) { return radiance_or_black<Spectrum>(radiance, channels); }

/// Radiance of the surface that was hit, or of the environment.
Spectrum radiance_behind(const TransportScene& scene, const SurfaceHit& hit);

/// The mean radiance along a camera ray if known, else NaN: see make_path_kernel.
Spectrum known_radiance(const TransportScene& scene, const Ray& camera);

/// Common base of all radiance kernels.
class RadianceKernel : public Kernel {
 public:
  explicit RadianceKernel(const TransportScene& scene)
      : scene_(scene),
        frame_(*scene.medium),
        extrema_(scene.medium->extrema(frame_.bounds)),
        channels_(scene.medium->channels()) {}

  bool needs_optical_depth() const override { return false; }
  bool needs_knots() const override { return false; }
  bool states_theory() const override { return false; }
  bool answers(Quantity quantity) const override { return quantity == Quantity::radiance; }
  std::size_t outputs(Quantity, const PreparedRay&) const override { return static_cast<std::size_t>(channels_); }
  bool flies() const override { return false; }
  std::vector<Theory> theory(const Workspace&, const RayProfile&, Quantity) const override {
    return std::vector<Theory>(static_cast<std::size_t>(channels_));
  }

 protected:
  TransportScene scene_;
  MediumFrame frame_;
  Extrema extrema_;
  int channels_;
};

/// For scenes that only absorb: the T of `transmittance` times the radiance behind the medium.  With constant extinction nothing
/// is drawn.
std::unique_ptr<const Kernel> make_beer_lambert_kernel(const TransportScene& scene);
std::unique_ptr<const Kernel> make_absorption_kernel(const TransportScene& scene, std::unique_ptr<const Kernel> transmittance);

}  // namespace nullmark
