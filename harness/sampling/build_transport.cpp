#include "harness/sampling/build_transport.h"

#include <algorithm>

namespace nullmark {

std::vector<Surface> build_surfaces(const std::vector<SurfaceSpec>& specs, int channels) {
  const auto point = [](const std::array<Real, 3>& p) { return Vec3(p[0], p[1], p[2]); };
  std::vector<Surface> surfaces;
  for (const SurfaceSpec& spec : specs) {
    Surface surface;
    if (spec.type == "plane") surface.shape = Plane{point(spec.point), point(spec.direction)};
    if (spec.type == "box") surface.shape = Box{point(spec.point), point(spec.direction)};
    if (spec.type == "sphere") surface.shape = Sphere{point(spec.point), spec.radius};
    if (!spec.radiance.empty()) surface.radiance = per_channel(spec.radiance, channels, "surfaces");
    surfaces.push_back(surface);
  }
  return surfaces;
}

BuiltRays cut_at(const std::vector<Surface>& surfaces, BuiltRays rays) {
  if (surfaces.empty()) return rays;
  for (std::size_t i = 0; i < rays.world.size(); ++i) {
    Ray& ray = rays.world[i];
    // What lies before the medium ends the ray as well.
    const Ray whole = {ray.origin, ray.direction, std::min<Real>(0, ray.begin), ray.end};
    ray.end = std::max(ray.begin, std::min(ray.end, first_hit(surfaces, whole).distance));
    rays.local[i].end = ray.end;
  }
  return rays;
}

TransportScene make_transport_scene(const MediumSpec& medium, const BuiltMedium& built,
                                    std::shared_ptr<const MajorantStructure> majorant, const TransportSpec& transport) {
  const int channels = built.medium->channels();
  const auto radiance = [&](const std::vector<Real>& values, const char* what) {
    return values.empty() ? Spectrum() : per_channel(values, channels, what);
  };
  TransportScene scene;
  scene.medium = built.medium;
  scene.majorant = std::move(majorant);
  scene.albedo = built.albedo;
  scene.albedo_field = built.albedo_field;
  scene.mean_cosine = medium.anisotropy;
  scene.emission.radiance = radiance(medium.emission, "emission");
  if (!medium.emission_field.empty()) scene.emission.field = build_medium(medium.emission_field[0]).medium;
  scene.environment.radiance = radiance(transport.environment, "environment");
  scene.surfaces = build_surfaces(transport.surfaces, channels);
  scene.options.next_event = transport.next_event == "phase"     ? NextEvent::phase
                             : transport.next_event == "uniform" ? NextEvent::uniform
                             : transport.next_event == "mis"     ? NextEvent::mis
                                                                 : NextEvent::off;
  scene.options.roulette_from = transport.roulette_from;
  scene.options.roulette_floor = transport.roulette_floor;
  scene.options.most_scatterings = transport.most_scatterings;
  return scene;
}

}  // namespace nullmark
