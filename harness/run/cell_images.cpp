#include "harness/run/cell_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/run/image.h"

namespace nullmark {
namespace {

/// What a cell's pixels hold, unrounded but for single precision: mean, reference, variance and what theory says of it per
/// channel, lookups and null collisions.
std::vector<Layer> layers(const PreparedCell& prepared, const Sampled& sampled) {
  const std::size_t outputs = prepared.targets.outputs, rays = prepared.scene->rays->world.size();
  std::vector<Layer> all;
  const auto add = [&](const std::string& name, auto value) {
    all.push_back({name, std::vector<Real>(rays)});
    for (std::size_t ray = 0; ray < rays; ++ray) all.back().values[ray] = value(ray);
  };
  for (std::size_t o = 0; o < outputs; ++o) {
    const auto truth = [&](std::size_t ray) {
      return measured(prepared.targets.mean[ray * outputs + o], prepared.cell->measurement);
    };
    const auto moments = [&](std::size_t ray) -> const Moments& { return sampled.moments[ray * outputs + o]; };
    add(fmt::format("mean.{}", o), [&](std::size_t ray) { return truth(ray) + moments(ray).mean(); });
    if (prepared.targets.known) add(fmt::format("reference.{}", o), truth);
    add(fmt::format("variance.{}", o), [&](std::size_t ray) { return moments(ray).variance(); });
    if (!prepared.theory.ray_variance.empty())
      add(fmt::format("variance_theory.{}", o), [&](std::size_t ray) { return prepared.theory.ray_variance[ray * outputs + o]; });
  }
  const auto per_sample = [&](std::uint64_t count) {
    return static_cast<Real>(count) / static_cast<Real>(prepared.samples_per_ray);
  };
  add("lookups", [&](std::size_t ray) { return per_sample(sampled.lookups[ray]); });
  add("null_collisions", [&](std::size_t ray) { return per_sample(sampled.null_collisions[ray]); });
  return all;
}

/// A cell's name as part of a file's, and enough of its id to be the only one: "ratio-linear-optical_depth-2-global.3f2a91bc".
std::string file_stem(const Cell& cell) {
  constexpr std::size_t kLongest = 80, kDigits = 8;
  std::string stem;
  for (const char c : cell.name.substr(0, kLongest)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_';
    if (plain || (!stem.empty() && stem.back() != '-')) stem += plain ? c : '-';
  }
  return fmt::format("{}.{}", stem, cell.id.substr(0, kDigits));
}

}  // namespace

void write_images(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled, const RunOptions& options,
                  const RunObserver& observer) {
  const BuiltRays& rays = *prepared.scene->rays;
  if (!prepared.cell->images || !prepared.targets.names.empty() || rays.width == 0 || options.image_directory.empty()) return;
  const auto channels = static_cast<std::size_t>(record.channels);
  const std::size_t shown = channels >= 3 ? 3 : 1, outputs = prepared.targets.outputs;
  std::vector<Real> mean, variance, reference, lookups, null_collisions;
  for (std::size_t ray = 0; ray < rays.world.size(); ++ray) {
    for (std::size_t c = 0; c < shown; ++c) {
      const Moments& moments = sampled.moments[ray * outputs + c];
      reference.push_back(measured(prepared.targets.mean[ray * outputs + c], prepared.cell->measurement));
      mean.push_back(reference.back() + moments.mean());
      variance.push_back(moments.variance());
    }
    lookups.push_back(static_cast<Real>(sampled.lookups[ray]) / static_cast<Real>(prepared.samples_per_ray));
    null_collisions.push_back(static_cast<Real>(sampled.null_collisions[ray]) / static_cast<Real>(prepared.samples_per_ray));
  }
  const auto greatest = [](const std::vector<Real>& values) {
    const Real most = *std::max_element(values.begin(), values.end());
    return most > 0 ? most : 1;
  };
  try {
    std::filesystem::create_directories(options.image_directory);
    const auto path_of = [&](const std::string& file) {
      const std::filesystem::path path = std::filesystem::path(options.image_directory) / file;
      expect_plain_or_none(path.string());
      return path.string();
    };
    const auto write = [&](const char* kind, const std::vector<Real>& values, std::size_t count, Real maximum) {
      const std::string file = fmt::format("{}.{}.png", file_stem(*prepared.cell), kind);
      write_png(path_of(file), rays.width, rays.height, static_cast<int>(count), values, maximum,
                prepared.cell->quantity == Quantity::radiance && &values == &mean);
      record.images[kind] = (std::filesystem::path(options.image_prefix) / file).string();
    };
    write("mean", mean, shown, prepared.cell->image_maximum);
    if (prepared.targets.known) write("reference", reference, shown, prepared.cell->image_maximum);
    write("variance", variance, shown, greatest(variance));
    write("lookups", lookups, 1, greatest(lookups));
    write("null_collisions", null_collisions, 1, greatest(null_collisions));
    const std::string file = fmt::format("{}.exr", file_stem(*prepared.cell));
    write_exr(path_of(file), rays.width, rays.height, layers(prepared, sampled));
    record.images["layers"] = (std::filesystem::path(options.image_prefix) / file).string();
  } catch (const std::exception& error) {
    observer.warning(error.what());
  }
}

}  // namespace nullmark
