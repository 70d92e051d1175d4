#include "harness/sampling/scene.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <set>

#include "harness/model/hash.h"
#include "harness/registry/components.h"
#include "media/base/albedo.h"
#include "media/base/channels.h"
#include "media/base/sum.h"

namespace nullmark {
namespace {

std::shared_ptr<const Medium> build_field(const MediumSpec& spec) {
  if (!spec.per_channel.empty()) {
    std::vector<std::shared_ptr<const Medium>> fields;
    for (const MediumSpec& channel : spec.per_channel) fields.push_back(build_field(channel));
    if (spec.field.type == "sum") return std::make_shared<Sum>(std::move(fields));
    return std::make_shared<PerChannel>(std::move(fields));
  }
  std::shared_ptr<const Medium> field = make_medium(spec.field)->build();
  if (spec.spectrum.empty()) return field;
  return std::make_shared<Spectral>(std::move(field), spec.spectrum);
}

/// Ends of cells in which a collision, averaged over the channels, is about equally probable.  A trapezoidal table of the optical
/// depth decides where they lie; what lies between them is integrated exactly afterwards.
void place_equally_probable(const Medium& medium, const Ray& local, std::span<Real> ends) {
  constexpr std::size_t kTable = 1024;
  const auto channels = static_cast<std::size_t>(medium.channels());
  const auto at = [&](std::size_t i) { return local.begin + local.length() * static_cast<Real>(i) / static_cast<Real>(kTable); };
  std::vector<Real> x(kTable + 1), y(kTable + 1), z(kTable + 1), mu((kTable + 1) * channels);
  for (std::size_t i = 0; i <= kTable; ++i) {
    const Vec3 p = local.at(at(i));
    x[i] = p.x(), y[i] = p.y(), z[i] = p.z();
  }
  medium.extinction({x.data(), y.data(), z.data(), kTable + 1}, mu.data());
  std::vector<Real> depth(channels, 0), before(channels, 0);
  const auto collided = [&](Real part) {
    Real sum = 0;
    for (std::size_t c = 0; c < channels; ++c) sum -= std::expm1(-(before[c] + part * (depth[c] - before[c])));
    return sum / static_cast<Real>(channels);
  };
  std::vector<Real> probability(kTable + 1, 0);
  const Real step = local.length() / static_cast<Real>(kTable);
  const auto advance = [&](std::size_t i) {
    before = depth;
    for (std::size_t c = 0; c < channels; ++c) {
      const Real mean = (mu[(i - 1) * channels + c] + mu[i * channels + c]) / 2;
      if (std::isfinite(mean)) depth[c] += mean * step;
    }
  };
  for (std::size_t i = 1; i <= kTable; ++i) {
    advance(i);
    probability[i] = collided(1);
  }
  std::fill(depth.begin(), depth.end(), Real{0});
  ends.front() = local.begin;
  std::size_t cell = 0;
  for (std::size_t j = 1; j + 1 < ends.size(); ++j) {
    const Real wanted = probability[kTable] * static_cast<Real>(j) / static_cast<Real>(ends.size() - 1);
    while (cell < kTable && (cell == 0 || probability[cell] < wanted)) advance(++cell);
    Real low = 0, high = 1;  // within the cell the optical depth grows evenly, the probability does not
    for (int i = 0; i < 40; ++i) (collided((low + high) / 2) < wanted ? low : high) = (low + high) / 2;
    ends[j] = std::max(ends[j - 1], at(cell - 1) + low * step);
  }
  ends.back() = local.end;
}

}  // namespace

Spectrum per_channel(const std::vector<Real>& values, int channels, const char* what) {
  const auto count = static_cast<std::size_t>(channels);
  if (values.size() > 1 && values.size() != count)
    throw ParameterError(
        what, fmt::format("found {} numbers; expected one, or {}, as many as the medium has channels", values.size(), channels));
  Spectrum result = Spectrum::Zero(channels);
  for (std::size_t c = 0; c < count && !values.empty(); ++c)
    result[static_cast<Eigen::Index>(c)] = values[values.size() > 1 ? c : 0];
  return result;
}

namespace {

/// Of the whole, of the components of a sum, or a field.
void add_albedo(BuiltMedium& built, const MediumSpec& spec) {
  const int channels = built.medium->channels();
  const auto scatters = [](const MediumSpec& part) { return !part.albedo.empty(); };
  if (!spec.albedo_field.empty()) {
    built.albedo_field = std::make_shared<FieldAlbedo>(build_medium(spec.albedo_field[0]).medium, channels);
  } else if (std::any_of(spec.per_channel.begin(), spec.per_channel.end(), scatters)) {
    Spectrum albedos = Spectrum::Zero(static_cast<Eigen::Index>(spec.per_channel.size()));
    for (Eigen::Index i = 0; i < albedos.size(); ++i) {
      const std::vector<Real>& own = spec.per_channel[static_cast<std::size_t>(i)].albedo;
      if (!own.empty()) albedos[i] = own[0];
    }
    built.albedo_field = std::make_shared<SumAlbedo>(std::dynamic_pointer_cast<const Sum>(built.medium), albedos);
  }
  MatterBounds& bounds = built.extrema;
  if (built.albedo_field) {
    built.albedo = built.albedo_field->most(channels);
    bounds.least_absorption = built.albedo_field->least_absorption(bounds.minimum);
    bounds.least_scattering = built.albedo_field->least_scattering(bounds.minimum);
    bounds.albedo_varies = true;
  } else {
    built.albedo = per_channel(spec.albedo, channels, "albedo");
    bounds.least_absorption = (1 - built.albedo) * bounds.minimum;
    bounds.least_scattering = built.albedo * bounds.minimum;
  }
}

}  // namespace

BuiltMedium build_medium(const MediumSpec& spec) {
  BuiltMedium built;
  built.medium = build_field(spec);
  const Box box = built.medium->bounds();
  built.extrema = built.medium->extrema(box);
  add_albedo(built, spec);
  const Affine to_world = built.medium->world_to_local().inverse();
  built.world_bounds = {Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p(corner & 1 ? box.hi.x() : box.lo.x(), corner & 2 ? box.hi.y() : box.lo.y(),
                 corner & 4 ? box.hi.z() : box.lo.z());
    built.world_bounds.lo = built.world_bounds.lo.cwiseMin(to_world * p);
    built.world_bounds.hi = built.world_bounds.hi.cwiseMax(to_world * p);
  }
  const auto add_content = [&](std::uint64_t content) {
    built.hash = fnv1a({reinterpret_cast<const char*>(&content), sizeof content}, built.hash);
  };
  built.hash = fnv1a(spec.label);
  add_content(built.medium->content_hash());
  if (built.albedo_field) add_content(built.albedo_field->content_hash());
  return built;
}

std::string hash_text(const BuiltMedium& medium) { return fmt::format("{:016x}", medium.hash); }
std::string hash_text(const TrackerIdentity& tracker) { return fmt::format("{:016x}", tracker.hash); }

BuiltMajorant build_majorant(const Component& spec, const BuiltMedium& medium) {
  const auto source = make_majorant(spec);
  const auto start = std::chrono::steady_clock::now();
  BuiltMajorant built{source->build(medium.medium)};
  built.build_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return built;
}

BuiltRays build_rays(const Component& spec, const BuiltMedium& medium) {
  RaySet set = make_ray_set(spec)->rays(medium.world_bounds);
  BuiltRays built{std::move(set.rays), {}, set.width, set.height};
  const Affine to_local = medium.medium->world_to_local();
  const Box bounds = medium.medium->bounds();
  built.local.reserve(built.world.size());
  for (Ray& ray : built.world) {
    built.local.push_back(clipped(transformed(ray, to_local), bounds));
    ray.begin = built.local.back().begin;
    ray.end = built.local.back().end;
  }
  return built;
}

BuiltRays thinned(BuiltRays rays, std::size_t most) {
  const std::size_t all = rays.world.size();
  if (all <= most) return rays;
  // Multiples of the golden section: equal steps would meet the same column of every row of a picture.
  constexpr Real kGolden = 0.6180339887498949;
  std::set<std::size_t> taken;
  for (std::size_t i = 0; i < most; ++i) {
    const Real multiple = (static_cast<Real>(i) + 0.5) * kGolden;
    taken.insert(std::min(all - 1, static_cast<std::size_t>((multiple - std::floor(multiple)) * static_cast<Real>(all))));
  }
  BuiltRays some;
  for (const std::size_t ray : taken) {
    some.world.push_back(rays.world[ray]);
    some.local.push_back(rays.local[ray]);
  }
  return some;
}

namespace {

constexpr Real kEpsilon = std::numeric_limits<Real>::epsilon();

/// What the rounding of points on a ray may add to its optical depth, per channel: a point is told to a unit in the last place of
/// its coordinates, and so are the ends of pieces.
Spectrum position_error(const BuiltMedium& medium, const Ray& world, const Ray& local) {
  if (!(local.length() > 0)) return Spectrum::Zero(medium.medium->channels());
  const Real coordinates = std::max(local.at(local.begin).cwiseAbs().maxCoeff(), local.at(local.end).cwiseAbs().maxCoeff());
  const Real origin = local.origin.cwiseAbs().maxCoeff();
  const Real lengths =
      std::max({std::max(coordinates, origin) / local.direction.norm(), std::abs(world.begin), std::abs(world.end)});
  const Real error = 4 * kEpsilon * lengths;
  if (medium.extrema.maximum.allFinite()) return error * medium.extrema.maximum;
  // Where the medium has a pole, what the ray can meet bounds it.
  const Vec3 from = local.at(local.begin), to = local.at(local.end);
  const Vec3 reach = Vec3::Constant(error * std::max<Real>(1, local.direction.norm()));
  return error * medium.medium->extrema({from.cwiseMin(to) - reach, from.cwiseMax(to) + reach}).maximum;
}

}  // namespace

Reference compute_reference(const BuiltMedium& medium, const BuiltRays& rays) {
  Reference reference;
  reference.channels = medium.medium->channels();
  const auto channels = static_cast<std::size_t>(reference.channels);
  reference.depth.resize(rays.local.size() * channels);
  reference.error.resize(rays.local.size() * channels);
  std::vector<const char*> method(rays.local.size(), "closed_form");
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays.local.size(), 16), [&](const auto& range) {
    for (std::size_t r = range.begin(); r < range.end(); ++r) {
      const DepthWithError result = optical_depth(*medium.medium, rays.local[r]);
      const Spectrum error = result.error + position_error(medium, rays.world[r], rays.local[r]);
      for (std::size_t c = 0; c < channels; ++c) {
        reference.depth[r * channels + c] = result.depth[static_cast<Eigen::Index>(c)];
        reference.error[r * channels + c] = error[static_cast<Eigen::Index>(c)];
      }
      method[r] = result.method;
    }
  });
  for (std::size_t r = 0; r < method.size(); ++r)
    if (reference.method.empty() || rays.local[r].length() > 0) {
      reference.method = method[r];
      if (rays.local[r].length() > 0) break;
    }
  return reference;
}

Marks compute_marks(const BuiltMedium& medium, const BuiltRays& rays, Quantity quantity) {
  const bool equidistant = quantity == Quantity::transmittance_profile;
  const auto channels = static_cast<std::size_t>(medium.medium->channels());
  Marks marks;
  marks.per_ray = equidistant ? kProfileMarks : kFreePathCells + 1;
  marks.distance.resize(rays.local.size() * marks.per_ray);
  marks.depth.resize(marks.distance.size() * channels);
  marks.error.resize(marks.depth.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays.local.size(), 4), [&](const auto& range) {
    for (std::size_t r = range.begin(); r < range.end(); ++r) {
      const Ray& local = rays.local[r];
      Real* distance = &marks.distance[r * marks.per_ray];
      if (equidistant)
        for (std::size_t j = 0; j < kProfileMarks; ++j)
          distance[j] = j + 1 == kProfileMarks
                            ? local.end
                            : local.begin + local.length() * static_cast<Real>(j + 1) / static_cast<Real>(kProfileMarks);
      else
        place_equally_probable(*medium.medium, local, {distance, marks.per_ray});
      Ray part = local;
      Spectrum depth = Spectrum::Zero(medium.medium->channels()), error = position_error(medium, rays.world[r], local);
      for (std::size_t j = 0; j < marks.per_ray; ++j) {
        part.end = distance[j];
        const DepthWithError added = optical_depth(*medium.medium, part);
        depth += added.depth;
        error += added.error;
        part.begin = distance[j];
        for (std::size_t c = 0; c < channels; ++c) {
          marks.depth[(r * marks.per_ray + j) * channels + c] = depth[static_cast<Eigen::Index>(c)];
          marks.error[(r * marks.per_ray + j) * channels + c] = error[static_cast<Eigen::Index>(c)];
        }
      }
    }
  });
  return marks;
}

void Scene::context(std::size_t ray, const Kernel& kernel, PreparedRay& out) const {
  out.world = rays->world[ray];
  out.local = rays->local[ray];
  out.index = static_cast<std::uint32_t>(ray);
  out.albedo = medium->albedo;
  out.albedo_field = medium->albedo_field.get();
  out.bounds.start(*majorant->structure, out.world, out.local);
  out.marks = {};
  if (marks) out.marks = {&marks->distance[ray * marks->per_ray], marks->per_ray};
  out.knots.clear();
  out.exact_depth.reset();
  if (kernel.needs_knots()) sorted_knots(*medium->medium, out.local, out.knots);
  if (kernel.needs_optical_depth()) out.exact_depth = optical_depth(*medium->medium, out.local).depth;
}

bool bounds_everywhere(const MajorantStructure& majorant, const BuiltRays& rays) {
  SegmentBuffer buffer;
  for (std::size_t ray = 0; ray < rays.local.size(); ++ray) {
    majorant.segments(rays.world[ray], rays.local[ray], buffer);
    for (const Segment& segment : buffer.segments)
      if (exceeds(segment.extinction.maximum.maxCoeff(), segment.majorant)) return false;
  }
  return true;
}

bool exceeds_somewhere(const BuiltMedium& built, const MajorantStructure& majorant, const BuiltRays& rays) {
  const Medium& medium = *built.medium;
  constexpr int kPoints = 8;
  SegmentBuffer buffer;
  std::vector<Real> knots;
  std::array<Real, kMaxChannels> mu{};
  for (std::size_t ray = 0; ray < rays.local.size(); ++ray) {
    const Ray& local = rays.local[ray];
    majorant.segments(rays.world[ray], local, buffer);
    for (const Segment& segment : buffer.segments) {
      // What cannot be above it need not be looked at.
      if (!exceeds(segment.extinction.maximum.maxCoeff(), segment.majorant)) continue;
      Ray part = local;
      part.begin = segment.begin;
      part.end = segment.end;
      sorted_knots(medium, part, knots);
      for (std::size_t i = 0; i + 1 < knots.size(); ++i)
        for (int k = 0; k < kPoints; ++k) {
          const Vec3 p = local.at(knots[i] + (knots[i + 1] - knots[i]) * (k + 0.5) / kPoints);
          medium.extinction({&p.x(), &p.y(), &p.z(), 1}, mu.data());
          if (exceeds(*std::max_element(mu.begin(), mu.begin() + medium.channels()), segment.majorant)) return true;
        }
    }
  }
  return false;
}

std::uint64_t stream_key(const Cell& cell, const BuiltMedium& medium) {
  std::uint64_t key = fnv1a({reinterpret_cast<const char*>(&cell.seed), sizeof cell.seed}, medium.hash);
  if (cell.own_streams) key = fnv1a(cell.estimator->label, key);
  return key;
}

}  // namespace nullmark
