#include "harness/targets.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

struct Memory {
  std::unique_ptr<Workspace> workspace;
  RayContext context;
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
      if (quantity != Quantity::transmittance_profile && quantity != Quantity::free_path) {
        scene.context(ray, kernel, mine.context);
        kernel.begin_ray(*mine.workspace, *scene.medium->medium, scene.medium->extrema, mine.context);
        const Spectrum expected = kernel.expected(*mine.workspace, scene.reference->at(ray), quantity);
        for (std::size_t c = 0; c < channels; ++c) {
          mean[c] = expected[static_cast<Eigen::Index>(c)];
          const Real depth_error = scene.reference->error[ray * channels + c];
          error[c] = quantity == Quantity::optical_depth ? depth_error : std::abs(mean[c]) * depth_error;
        }
        continue;
      }
      const Marks& marks = *scene.marks;
      const auto transmittance = [&](std::size_t mark, std::size_t c) {
        return std::exp(-marks.depth[(ray * marks.per_ray + mark) * channels + c]);
      };
      const auto uncertainty = [&](std::size_t mark, std::size_t c) {
        return transmittance(mark, c) * marks.error[(ray * marks.per_ray + mark) * channels + c];
      };
      if (quantity == Quantity::transmittance_profile) {
        for (std::size_t j = 0; j < marks.per_ray; ++j)
          for (std::size_t c = 0; c < channels; ++c) {
            mean[j * channels + c] = transmittance(j, c);
            error[j * channels + c] = uncertainty(j, c);
          }
        continue;
      }
      const std::size_t last = marks.per_ray - 1, width = last / kFreePathBins;
      for (std::size_t c = 0; c < channels; ++c) {
        std::size_t output = c;
        const auto put = [&](Real m, Real e) {
          mean[output] = m;
          error[output] = e;
          output += channels;
        };
        for (std::size_t bin = 0; bin < kFreePathBins; ++bin) {
          const std::size_t from = bin * width, to = from + width;
          put(transmittance(from, c) - transmittance(to, c), uncertainty(from, c) + uncertainty(to, c));
        }
        const Real escape = transmittance(last, c), depth = marks.depth[(ray * marks.per_ray + last) * channels + c];
        const Real albedo = scene.medium->albedo[static_cast<Eigen::Index>(c)];
        if (scatters(scene.medium->albedo)) put(albedo * -std::expm1(-depth), uncertainty(last, c));
        put(escape, uncertainty(last, c));
        put(1, 0);
      }
    }
  });
  if (given) {
    if (given->value.size() != 1 && given->value.size() != targets.outputs)
      throw ParameterError("reference", fmt::format("found {} values; expected 1, or {}, as many as a sample has numbers",
                                                    given->value.size(), targets.outputs));
    for (std::size_t i = 0; i < targets.mean.size(); ++i) {
      const Real value = given->value[given->value.size() > 1 ? i % targets.outputs : 0], known = targets.mean[i];
      constexpr Real kRounding = 1e-9;
      if (std::isfinite(known) && std::abs(value - known) > std::abs(value) * given->error + targets.error[i] + kRounding)
        throw ParameterError("reference", fmt::format("found {} ({}); the mean is known here, {:.9g} by {}", value, given->source,
                                                      known, targets.method));
      targets.mean[i] = value;
      targets.error[i] = std::abs(value) * given->error;
    }
    targets.method = "given: " + given->source;
  }
  targets.known = std::all_of(targets.mean.begin(), targets.mean.end(), [](Real x) { return std::isfinite(x); });
  if (!targets.known) {
    targets.mean.assign(targets.mean.size(), 0);
    targets.error.assign(targets.error.size(), 0);
    targets.method = "none";
  }
  return targets;
}

}  // namespace nullmark
