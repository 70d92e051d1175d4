#include "harness/sampling/targets.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "harness/sampling/theory.h"

namespace nullmark {
namespace {

struct Memory {
  std::unique_ptr<Workspace> workspace;
  PreparedRay context;
};

std::vector<std::string> with_channels(const std::vector<std::string>& names, std::size_t channels) {
  if (channels == 1) return names;
  std::vector<std::string> all;
  for (const std::string& name : names)
    for (std::size_t c = 0; c < channels; ++c) all.push_back(fmt::format("{}/channel {}", name, c));
  return all;
}

std::vector<std::string> output_names(Quantity quantity, const Scene& scene) {
  std::vector<std::string> names;
  if (quantity == Quantity::transmittance_profile)
    for (std::size_t j = 1; j <= kProfileMarks; ++j) names.push_back(fmt::format("T({}/{})", j, kProfileMarks));
  if (quantity == Quantity::free_path) {
    for (std::size_t j = 1; j <= kFreePathBins; ++j) names.push_back(fmt::format("bin {}", j));
    if (scatters(scene.medium->albedo)) names.emplace_back("scatter");
    names.insert(names.end(), {"escape", "weight"});
  }
  return with_channels(names, static_cast<std::size_t>(scene.reference->channels));
}

/// Transmittance from where a ray begins to each of its marks, and the bound on its error.
class MarkedTransmittance {
 public:
  MarkedTransmittance(const Scene& scene, std::size_t ray)
      : marks_(*scene.marks), first_(ray * marks_.per_ray), channels_(static_cast<std::size_t>(scene.reference->channels)) {}

  Real depth(std::size_t mark, std::size_t channel) const { return marks_.depth[(first_ + mark) * channels_ + channel]; }
  Real transmittance(std::size_t mark, std::size_t channel) const { return std::exp(-depth(mark, channel)); }
  Real error(std::size_t mark, std::size_t channel) const {
    return transmittance(mark, channel) * marks_.error[(first_ + mark) * channels_ + channel];
  }
  std::size_t marks() const { return marks_.per_ray; }
  std::size_t channels() const { return channels_; }

 private:
  const Marks& marks_;
  std::size_t first_, channels_;
};

void profile_targets(const MarkedTransmittance& marked, Real* mean, Real* error) {
  for (std::size_t j = 0; j < marked.marks(); ++j)
    for (std::size_t c = 0; c < marked.channels(); ++c) {
      mean[j * marked.channels() + c] = marked.transmittance(j, c);
      error[j * marked.channels() + c] = marked.error(j, c);
    }
}

/// int mu_s T dt, and a bound on its error.
struct Scattered {
  Spectrum mean, error;
};

/// Where the albedo is constant it is a share of all collisions.
Scattered scattered_evenly(const MarkedTransmittance& marked, const Spectrum& albedo) {
  Scattered result{albedo, albedo};
  const std::size_t last = marked.marks() - 1;
  for (std::size_t c = 0; c < marked.channels(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    result.mean[i] = albedo[i] * -std::expm1(-marked.depth(last, c));
    result.error[i] = marked.error(last, c);
  }
  return result;
}

/// By quadrature between the knots of extinction and albedo and the marks, between which few collide.
Spectrum scattered_by_panels(const Scene& scene, std::size_t ray, const std::vector<Real>& cuts) {
  const Medium& medium = *scene.medium->medium;
  const AlbedoField& field = *scene.medium->albedo_field;
  const Ray &world = scene.rays->world[ray], &local = scene.rays->local[ray];
  const int channels = medium.channels();
  const Real end = cuts.back(), none = 0;
  const RayProfile profile(lookups_along(medium, local), channels, cuts, {&end, 1}, {&none, 1});
  Spectrum mean = Spectrum::Zero(channels);
  for (int c = 0; c < channels; ++c)
    mean[c] = profile.integrate(c, [&](const RayProfile::Node& at) {
      return albedo_at<Spectrum>(field, world.at(at.t), channels)[c] * at.extinction * std::exp(-at.depth);
    });
  return mean;
}

/// The quadrature is repeated with panels of half the size: the difference bounds the error of the better one.
Scattered scattered_along(const Scene& scene, std::size_t ray) {
  const Ray &world = scene.rays->world[ray], &local = scene.rays->local[ray];
  const Marks& marks = *scene.marks;
  std::vector<Real> cuts, found;
  sorted_knots(*scene.medium->medium, local, cuts);
  scene.medium->albedo_field->knots(world, found);
  found.insert(found.end(), &marks.distance[ray * marks.per_ray], &marks.distance[ray * marks.per_ray] + marks.per_ray);
  for (const Real t : found)
    if (t > local.begin && t < local.end) cuts.push_back(t);
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  std::vector<Real> halved = {cuts[0]};
  for (std::size_t i = 1; i < cuts.size(); ++i) halved.insert(halved.end(), {(cuts[i - 1] + cuts[i]) / 2, cuts[i]});
  const Spectrum coarse = scattered_by_panels(scene, ray, cuts), fine = scattered_by_panels(scene, ray, halved);
  constexpr Real kRounding = 1e-14;
  return {fine, (fine - coarse).abs() + kRounding};
}

void free_path_targets(const MarkedTransmittance& marked, const std::optional<Scattered>& scattered, Real* mean, Real* error) {
  const std::size_t last = marked.marks() - 1, width = last / kFreePathBins;
  for (std::size_t c = 0; c < marked.channels(); ++c) {
    std::size_t output = c;
    const auto put = [&](Real m, Real e) {
      mean[output] = m;
      error[output] = e;
      output += marked.channels();
    };
    for (std::size_t bin = 0; bin < kFreePathBins; ++bin) {
      const std::size_t from = bin * width, to = from + width;
      put(marked.transmittance(from, c) - marked.transmittance(to, c), marked.error(from, c) + marked.error(to, c));
    }
    if (scattered) put(scattered->mean[static_cast<Eigen::Index>(c)], scattered->error[static_cast<Eigen::Index>(c)]);
    put(marked.transmittance(last, c), marked.error(last, c));
    put(1, 0);
  }
}

/// Throws ParameterError where what is given contradicts what is known.
void take_given(Targets& targets, const GivenReference& given) {
  bool taken = false;
  if (given.value.size() != 1 && given.value.size() != targets.outputs)
    throw ParameterError("reference", fmt::format("found {} values; expected 1, or {}, as many as a sample has numbers",
                                                  given.value.size(), targets.outputs));
  for (std::size_t i = 0; i < targets.mean.size(); ++i) {
    const Real value = given.value[given.value.size() > 1 ? i % targets.outputs : 0], known = targets.mean[i];
    constexpr Real kRounding = 1e-9;
    if (std::isfinite(known) && std::abs(value - known) > std::abs(value) * given.error + targets.error[i] + kRounding)
      throw ParameterError("reference", fmt::format("found {} ({}); the mean is known here, {:.9g} by {}", value, given.source,
                                                    known, targets.method));
    // What is known here with a smaller error stays; what is given has confirmed it.
    const Real error = std::abs(value) * given.error;
    if (std::isfinite(known) && targets.error[i] <= std::max(error, kRounding)) continue;
    targets.mean[i] = value;
    targets.error[i] = error;
    taken = true;
  }
  if (taken) targets.method = "given: " + given.source;
}

}  // namespace

Targets compute_targets(const Scene& scene, const Kernel& kernel, Quantity quantity, const std::optional<GivenReference>& given) {
  const std::size_t rays = scene.rays->world.size();
  const auto channels = static_cast<std::size_t>(scene.reference->channels);
  Targets targets;
  targets.names = output_names(quantity, scene);
  targets.outputs = targets.names.empty() ? channels : targets.names.size();
  targets.method = scene.reference->method;
  targets.mean.resize(rays * targets.outputs);
  targets.error.resize(rays * targets.outputs);

  tbb::enumerable_thread_specific<Memory> memory([&] { return Memory{kernel.workspace(), {}}; });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays, 64), [&](const auto& range) {
    Memory& mine = memory.local();
    for (std::size_t ray = range.begin(); ray < range.end(); ++ray) {
      Real *mean = &targets.mean[ray * targets.outputs], *error = &targets.error[ray * targets.outputs];
      if (quantity == Quantity::transmittance_profile) {
        profile_targets(MarkedTransmittance(scene, ray), mean, error);
        continue;
      }
      if (quantity == Quantity::free_path) {
        const MarkedTransmittance marked(scene, ray);
        std::optional<Scattered> scattered;
        if (scene.medium->albedo_field)
          scattered = scattered_along(scene, ray);
        else if (scatters(scene.medium->albedo))
          scattered = scattered_evenly(marked, scene.medium->albedo);
        free_path_targets(marked, scattered, mean, error);
        continue;
      }
      scene.context(ray, kernel, mine.context);
      kernel.begin_ray(*mine.workspace, *scene.medium->medium, scene.medium->extrema, mine.context);
      const Spectrum expected = kernel.expected(*mine.workspace, scene.reference->at(ray), quantity);
      for (std::size_t c = 0; c < channels; ++c) {
        mean[c] = expected[static_cast<Eigen::Index>(c)];
        const Real depth_error = scene.reference->error[ray * channels + c];
        error[c] = quantity == Quantity::optical_depth ? depth_error : std::abs(mean[c]) * depth_error;
      }
    }
  });
  if (given) take_given(targets, *given);
  targets.known = std::all_of(targets.mean.begin(), targets.mean.end(), [](Real x) { return std::isfinite(x); });
  if (!targets.known) {
    targets.mean.assign(targets.mean.size(), 0);
    targets.error.assign(targets.error.size(), 0);
    targets.method = "none";
  }
  return targets;
}

}  // namespace nullmark
