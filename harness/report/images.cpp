#include "harness/report/images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include "harness/io/packing.h"
#include "harness/run/image.h"

namespace nullmark {
namespace {

/// Pixels across that a page shows; larger pictures are averaged down.
constexpr int kMostPixels = 256;

struct Picture {
  int width = 0, height = 0;
  std::vector<Real> values;
};

/// Means over factor x factor pixels; incomplete ones at the far edges are left out.
Picture shrunk(const Picture& picture, int factor) {
  if (factor == 1) return picture;
  Picture small{picture.width / factor, picture.height / factor, {}};
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      Real sum = 0;
      for (int v = 0; v < factor; ++v)
        for (int u = 0; u < factor; ++u)
          sum += picture.values[static_cast<std::size_t>(y * factor + v) * static_cast<std::size_t>(picture.width) +
                                static_cast<std::size_t>(x * factor + u)];
      small.values.push_back(sum / (factor * factor));
    }
  return small;
}

/// low + (high - low) k / 65534 for k < 65535, which stands for a number that is not finite.
Json quantised(const Picture& picture) {
  Real low = kInfinity, high = -kInfinity;
  for (const Real value : picture.values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (!(low <= high)) low = high = 0;
  std::string bytes;
  for (const Real value : picture.values) {
    const Real share = high > low ? (value - low) / (high - low) : 0;
    const auto k = std::isfinite(value) ? static_cast<std::uint16_t>(std::lround(65534 * share)) : std::uint16_t{65535};
    bytes += static_cast<char>(k & 255);
    bytes += static_cast<char>(k >> 8);
  }
  return {{"width", picture.width}, {"height", picture.height}, {"low", low}, {"high", high}, {"data", base64(bytes)}};
}

/// Of all layers of a kind, which are its channels.
Picture of_kind(const LayeredImage& image, const std::string& kind) {
  Picture picture{image.width, image.height, {}};
  Real channels = 0;
  for (const Layer& layer : image.layers) {
    if (layer.name != kind && layer.name.rfind(kind + ".", 0) != 0) continue;
    picture.values.resize(layer.values.size());
    for (std::size_t i = 0; i < layer.values.size(); ++i) picture.values[i] += layer.values[i];
    ++channels;
  }
  for (Real& value : picture.values) value /= channels;
  return picture;
}

}  // namespace

Json ReportImages::add(const CellRecord& record, const std::string& results_file) {
  const auto layers = record.images.find("layers");
  if (layers == record.images.end()) return nullptr;
  // Results may come from anywhere; their pictures lie beside them.
  const std::filesystem::path relative(layers->second);
  LayeredImage image;
  try {
    if (relative.is_absolute() || std::find(relative.begin(), relative.end(), "..") != relative.end())
      throw std::runtime_error(fmt::format("{}: leads out of the folder of the results", layers->second));
    image = read_exr((std::filesystem::path(results_file).parent_path() / relative).string());
  } catch (const std::exception& error) {
    missing_.emplace(results_file, Missing{relative.parent_path().string(), error.what()});
    return nullptr;
  }
  const int factor = (std::max(image.width, image.height) + kMostPixels - 1) / kMostPixels;
  Json places = Json::object();
  for (const char* kind : {"mean", "reference", "variance", "variance_theory", "lookups", "null_collisions"}) {
    const Picture picture = of_kind(image, kind);
    if (picture.values.empty()) continue;
    Json json = quantised(shrunk(picture, factor));
    const auto [place, fresh] = places_.try_emplace(json.dump(), images_.size());
    if (fresh) images_.push_back(std::move(json));
    places[kind] = place->second;
  }
  return places;
}

}  // namespace nullmark
