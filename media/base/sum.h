#pragma once

#include <array>

#include "media/base/channels.h"

namespace nullmark {

/// mu(p) = sum_i mu_i(p) of grey media told in one local frame, each zero outside its own box: clouds in haze, a smooth profile
/// above a constant floor.  1 to kMaxChannels of them.  Bounds are sums of bounds; trackers may ask for one component at a time.
class Sum final : public Medium {
 public:
  explicit Sum(std::vector<std::shared_ptr<const Medium>> components) : parts_(std::move(components)) {}

  Box bounds() const override { return parts_.bounds(); }
  Affine world_to_local() const override { return parts_.world_to_local(); }
  std::uint64_t content_hash() const override { return parts_.content_hash(); }
  void knots(const Ray& ray, std::vector<Real>& t) const override { parts_.knots(ray, t); }
  std::optional<int> polynomial_degree() const override { return parts_.polynomial_degree(); }

  void extinction(const Points& points, Real* out) const override {
    const auto n = static_cast<std::size_t>(parts_.channels());
    std::array<Real, kBlock * kMaxChannels> all;
    for (std::size_t begin = 0; begin < points.size; begin += kBlock) {
      const std::size_t size = std::min(kBlock, points.size - begin);
      parts_.extinction({points.x + begin, points.y + begin, points.z + begin, size}, all.data());
      for (std::size_t i = 0; i < size; ++i) out[begin + i] = Eigen::Map<const Spectrum>(&all[i * n], parts_.channels()).sum();
    }
  }

  Extrema extrema(const Box& box) const override {
    const Extrema all = parts_.extrema(box);
    return Extrema::grey(all.minimum.sum(), all.average.sum(), all.maximum.sum());
  }

  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    const std::optional<Spectrum> all = parts_.optical_depth(ray);
    if (!all) return std::nullopt;
    return Spectrum::Constant(1, all->sum());
  }

  int components() const override { return parts_.channels(); }
  Spectrum component_maxima(const Box& box) const override { return parts_.extrema(box).maximum; }
  Spectrum component_minima(const Box& box) const { return parts_.extrema(box).minimum; }
  Real component_extinction(int component, const Vec3& point) const override {
    return parts_.channel_extinction(component, point);
  }

 private:
  static constexpr std::size_t kBlock = 64;

  PerChannel parts_;
};

}  // namespace nullmark
