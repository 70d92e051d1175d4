#include "harness/sampling/pixel_groups.h"

#include <algorithm>
#include <cmath>

#include "harness/sampling/test_plan.h"

namespace nullmark {

PixelGroups::PixelGroups(const BuiltRays& rays, int channels) : channels_(static_cast<std::size_t>(channels)), pixels_(1) {
  const std::vector<int> group_of = ray_groups(rays);
  const bool grouped = std::any_of(group_of.begin(), group_of.end(), [](int group) { return group > 0; });
  if (grouped) pixels_.resize(1 + kRayGroups);
  for (std::size_t ray = 0; ray < group_of.size(); ++ray) {
    pixels_[0].push_back(ray);
    if (grouped) pixels_[static_cast<std::size_t>(group_of[ray]) + 1].push_back(ray);
  }
}

void PixelGroups::add(std::span<const Real> picture) {
  for (const std::vector<std::size_t>& group : pixels_)
    for (std::size_t c = 0; c < channels_; ++c) {
      Real sum = 0;
      for (const std::size_t pixel : group) sum += picture[pixel * channels_ + c];
      means_.push_back(sum / static_cast<Real>(group.size()));
    }
  ++pictures_;
}

std::shared_ptr<const GivenSamples> PixelGroups::samples(std::size_t group, std::size_t channel) const {
  auto samples = std::make_shared<GivenSamples>(1, 1, pictures_, false);
  for (std::uint64_t picture = 0; picture < pictures_; ++picture)
    samples->set(0, picture, 0, means_[(static_cast<std::size_t>(picture) * pixels_.size() + group) * channels_ + channel]);
  return samples;
}

namespace {

class PictureEstimator final : public EstimatorSource {
 public:
  explicit PictureEstimator(PictureSource source) : source_(std::move(source)) {}

  void parameters(ParameterVisitor&) override {}
  Guarantee claim(Quantity) const override { return Guarantee::unbiased; }
  SampleRange range(int) const override { return source_.range; }
  bool needs_bound() const override { return false; }
  std::optional<Real> order(Quantity) const override { return std::nullopt; }
  void check(const MatterBounds&) const override {}
  std::unique_ptr<const Kernel> kernel(int, Precision, bool) const override { return nullptr; }
  std::optional<TrackerIdentity> identity() const override {
    return TrackerIdentity{source_.name, "", source_.hash, true, false};
  }

 private:
  PictureSource source_;
};

/// A depth whose target is the mean of the targets of the pixels: of a transmittance, -log of the mean.
std::shared_ptr<const Reference> mean_reference(const Reference& of_pixels, const std::vector<std::size_t>& pixels,
                                                std::size_t channel, Quantity quantity) {
  // Beyond it a transmittance underflows.
  constexpr Real kDeepest = 800;
  // What the logarithm and its exponential round.
  constexpr Real kRounding = 1e-12;
  const auto channels = static_cast<std::size_t>(of_pixels.channels);
  const bool transmitted = quantity == Quantity::transmittance;
  Real value = 0, error = 0;
  for (const std::size_t pixel : pixels) {
    const Real depth = of_pixels.depth[pixel * channels + channel], of_depth = of_pixels.error[pixel * channels + channel];
    value += (transmitted ? std::exp(-depth) : depth) / static_cast<Real>(pixels.size());
    error += (transmitted ? std::exp(-depth) * of_depth : of_depth) / static_cast<Real>(pixels.size());
  }
  if (transmitted) {
    error = value > 0 ? error / value + kRounding : 0;
    value = value > 0 ? std::clamp<Real>(-std::log(value), 0, kDeepest) : kDeepest;
  }
  auto reference = std::make_shared<Reference>();
  reference->method = of_pixels.method;
  reference->depth = {value};
  reference->error = {error};
  return reference;
}

}  // namespace

PreparedCell group_cell(const PreparedCell& whole, const PixelGroups& pictures, std::size_t group, std::size_t channel,
                        const PictureSource& source) {
  const std::vector<std::size_t>& pixels = pictures.pixels(group);
  auto rays = std::make_shared<BuiltRays>();
  rays->world = {whole.scene->rays->world[pixels.front()]};
  rays->local = {whole.scene->rays->local[pixels.front()]};
  auto scene = std::make_shared<Scene>(*whole.scene);
  scene->rays = rays;
  scene->reference = mean_reference(*whole.scene->reference, pixels, channel, whole.cell->quantity);
  PreparedCell cell;
  cell.cell = whole.cell;
  cell.index = whole.index;
  cell.scene = scene;
  cell.source = std::make_shared<PictureEstimator>(source);
  cell.kernel = make_given_samples_kernel(pictures.samples(group, channel));
  cell.targets = compute_targets(*scene, *cell.kernel, whole.cell->quantity);
  cell.samples_per_ray = split_samples(pictures.pictures()).judged;
  cell.range = source.range;
  return cell;
}

}  // namespace nullmark
