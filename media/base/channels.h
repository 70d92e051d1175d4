#pragma once

#include <array>
#include <string>
#include <utility>

#include "media/base/medium.h"

namespace nullmark {

/// A grey medium times a spectrum: mu_c(p) = spectrum[c] mu(p), one grey lookup for all channels (the usual chromatic medium of
/// Kutz et al. 2017: one density, one spectral cross-section).  1 to kMaxChannels factors, finite and >= 0, without a unit.
class Spectral final : public Medium {
 public:
  Spectral(std::shared_ptr<const Medium> grey, const std::vector<Real>& spectrum) : grey_(std::move(grey)) {
    if (!grey_ || grey_->channels() != 1) throw ParameterError("medium", "a spectrum can scale a grey medium only");
    if (spectrum.empty() || spectrum.size() > kMaxChannels)
      throw ParameterError(
          "spectrum", "found " + std::to_string(spectrum.size()) + " channels; expected 1 to " + std::to_string(kMaxChannels));
    for (const Real factor : spectrum)
      if (!(factor >= 0 && std::isfinite(factor)))
        throw ParameterError("spectrum", "found the factor " + std::to_string(factor) + "; expected finite numbers >= 0");
    spectrum_ = Eigen::Map<const Spectrum>(spectrum.data(), static_cast<Eigen::Index>(spectrum.size()));
  }

  int channels() const override { return static_cast<int>(spectrum_.size()); }
  Box bounds() const override { return grey_->bounds(); }
  Affine world_to_local() const override { return grey_->world_to_local(); }

  void extinction(const Points& points, Real* out) const override {
    grey_->extinction(points, out);
    if (channels() == 3) return spread(SpectrumOf<3>(spectrum_), points.size, out);
    if (channels() == 4) return spread(SpectrumOf<4>(spectrum_), points.size, out);
    spread(spectrum_, points.size, out);
  }

  Extrema extrema(const Box& box) const override {
    const Extrema grey = grey_->extrema(box);
    return {nullmark::scaled(spectrum_, grey.minimum[0]), nullmark::scaled(spectrum_, grey.average[0]),
            nullmark::scaled(spectrum_, grey.maximum[0])};
  }

  std::optional<ScaledField> scaled() const override { return ScaledField{grey_.get(), spectrum_}; }
  bool has_nodes() const override { return grey_->has_nodes(); }

  void knots(const Ray& ray, std::vector<Real>& t) const override { grey_->knots(ray, t); }
  std::optional<int> polynomial_degree() const override { return grey_->polynomial_degree(); }
  std::uint64_t content_hash() const override { return grey_->content_hash(); }

  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    const std::optional<Spectrum> grey = grey_->optical_depth(ray);
    if (!grey) return std::nullopt;
    return nullmark::scaled(spectrum_, (*grey)[0]);
  }

  std::optional<Real> distance_at_depth(const Ray& ray, Real depth) const override {
    if (channels() > 1) return std::nullopt;
    return spectrum_[0] > 0 ? grey_->distance_at_depth(ray, depth / spectrum_[0]) : kInfinity;
  }

 private:
  /// The grey values sit at the front of out; spreading them from the last one on overwrites none that is still needed.
  template <class Factors>
  static void spread(const Factors factors, std::size_t size, Real* out) {
    const Eigen::Index n = factors.size();
    for (std::size_t i = size; i-- > 0;) {
      const Real grey = out[i];
      for (Eigen::Index c = 0; c < n; ++c) out[i * static_cast<std::size_t>(n) + static_cast<std::size_t>(c)] = factors[c] * grey;
    }
  }

  std::shared_ptr<const Medium> grey_;
  Spectrum spectrum_;
};

/// One grey medium per channel, all told in one local frame; each is zero outside its own box, the whole is bounded by their
/// union. For spectra that vary in space, and for what a single density cannot show: channels whose dense parts lie apart.
class PerChannel final : public Medium {
 public:
  explicit PerChannel(std::vector<std::shared_ptr<const Medium>> components) : components_(std::move(components)) {
    if (components_.empty() || components_.size() > kMaxChannels)
      throw ParameterError(
          "media", "found " + std::to_string(components_.size()) + " channels; expected 1 to " + std::to_string(kMaxChannels));
    for (std::size_t c = 0; c < components_.size(); ++c) {
      if (!components_[c] || components_[c]->channels() != 1)
        throw ParameterError("media", "medium " + std::to_string(c) + " is not grey; each gives one channel");
      // Frames that were computed differently may differ by rounding.
      if (!components_[c]->world_to_local().isApprox(components_[0]->world_to_local(), 1e-12))
        throw ParameterError(
            "media", "medium " + std::to_string(c) + " has another local frame than medium 0; per-channel media must share one");
      boxes_.push_back(components_[c]->bounds());
      bounds_.lo = c == 0 ? boxes_[c].lo : bounds_.lo.cwiseMin(boxes_[c].lo).eval();
      bounds_.hi = c == 0 ? boxes_[c].hi : bounds_.hi.cwiseMax(boxes_[c].hi).eval();
    }
  }

  int channels() const override { return static_cast<int>(components_.size()); }
  Box bounds() const override { return bounds_; }
  Affine world_to_local() const override { return components_[0]->world_to_local(); }

  void extinction(const Points& points, Real* out) const override {
    for (std::size_t begin = 0; begin < points.size; begin += kBlock) {
      const Points block = {points.x + begin, points.y + begin, points.z + begin, std::min(kBlock, points.size - begin)};
      for (std::size_t c = 0; c < components_.size(); ++c) look_up(c, block, out + begin * components_.size() + c);
    }
  }

  /// One channel at a point.
  Real channel_extinction(int channel, const Vec3& point) const {
    const auto c = static_cast<std::size_t>(channel);
    const Vec3 p = point.cwiseMax(bounds_.lo).cwiseMin(bounds_.hi);
    if ((p.array() < boxes_[c].lo.array()).any() || (p.array() > boxes_[c].hi.array()).any()) return 0;
    Real out = 0;
    components_[c]->extinction({&p.x(), &p.y(), &p.z(), 1}, &out);
    return out;
  }

  Extrema extrema(const Box& box) const override {
    const auto n = static_cast<Eigen::Index>(components_.size());
    Extrema all = {Spectrum::Zero(n), Spectrum::Zero(n), Spectrum::Zero(n)};
    const Box cut = {box.lo.cwiseMax(bounds_.lo), box.hi.cwiseMin(bounds_.hi)};
    for (Eigen::Index c = 0; c < n; ++c) {
      const Box& own = boxes_[static_cast<std::size_t>(c)];
      const Box part = {cut.lo.cwiseMax(own.lo), cut.hi.cwiseMin(own.hi)};
      const Real fraction = covered(part, cut);
      if (!(fraction > 0)) continue;
      const Extrema one = components_[static_cast<std::size_t>(c)]->extrema(part);
      all.minimum[c] = fraction < 1 ? 0 : one.minimum[0];
      all.average[c] = fraction * one.average[0];
      all.maximum[c] = one.maximum[0];
    }
    return all;
  }

  bool has_nodes() const override {
    return std::all_of(components_.begin(), components_.end(), [](const auto& component) { return component->has_nodes(); });
  }

  void knots(const Ray& ray, std::vector<Real>& t) const override {
    for (std::size_t c = 0; c < components_.size(); ++c) {
      const Ray inside = clipped(ray, boxes_[c]);
      if (!(inside.length() > 0)) continue;
      components_[c]->knots(inside, t);
      if (inside.begin > ray.begin) t.push_back(inside.begin);
      if (inside.end < ray.end) t.push_back(inside.end);
    }
  }

  std::optional<int> polynomial_degree() const override {
    int degree = 0;
    for (const auto& component : components_) {
      const std::optional<int> one = component->polynomial_degree();
      if (!one) return std::nullopt;
      degree = std::max(degree, *one);
    }
    return degree;
  }

  // Order matters: the same files in other channels are another medium.
  std::uint64_t content_hash() const override {
    std::uint64_t hash = 0;
    for (const auto& component : components_) hash = (hash ^ (hash >> 29)) * 0x9E3779B97F4A7C15 + component->content_hash();
    return hash;
  }

  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    Spectrum all = Spectrum::Zero(static_cast<Eigen::Index>(components_.size()));
    for (std::size_t c = 0; c < components_.size(); ++c) {
      const Ray inside = clipped(ray, boxes_[c]);
      if (!(inside.length() > 0)) continue;
      const std::optional<Spectrum> one = components_[c]->optical_depth(inside);
      if (!one) return std::nullopt;
      all[static_cast<Eigen::Index>(c)] = (*one)[0];
    }
    return all;
  }

 private:
  static constexpr std::size_t kBlock = 64;

  /// One channel of a block, in gathers of the points inside that channel's own box: a medium need not stand others.
  void look_up(std::size_t c, const Points& points, Real* out) const {
    std::array<Real, kBlock> x, y, z, value;
    std::array<std::size_t, kBlock> index;
    std::size_t inside = 0;
    for (std::size_t i = 0; i < points.size; ++i) {
      // Rounding may put a point just outside the union, hence outside every box: it belongs to the face it left.
      const Vec3 p = points[i].cwiseMax(bounds_.lo).cwiseMin(bounds_.hi);
      out[i * components_.size()] = 0;
      if ((p.array() < boxes_[c].lo.array()).any() || (p.array() > boxes_[c].hi.array()).any()) continue;
      x[inside] = p[0];
      y[inside] = p[1];
      z[inside] = p[2];
      index[inside++] = i;
    }
    if (inside == 0) return;
    components_[c]->extinction({x.data(), y.data(), z.data(), inside}, value.data());
    for (std::size_t i = 0; i < inside; ++i) out[index[i] * components_.size()] = value[i];
  }

  /// The part's fraction of a box, 1 or 0 where they differ or overlap by no more than rounding: boxes of an aligned grid would
  /// otherwise get their neighbours' bounds.  Sides of length zero count as covered where they touch.
  static Real covered(const Box& part, const Box& box) {
    Real fraction = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const Real whole = box.hi[axis] - box.lo[axis], side = part.hi[axis] - part.lo[axis];
      if (!(side >= 0)) return 0;
      if (whole == 0) continue;
      const Real rounding =
          8 * std::numeric_limits<Real>::epsilon() * std::max({whole, std::abs(box.lo[axis]), std::abs(box.hi[axis])});
      if (whole - side <= rounding) continue;
      if (side <= rounding) return 0;
      fraction *= side / whole;
    }
    return fraction;
  }

  std::vector<std::shared_ptr<const Medium>> components_;
  std::vector<Box> boxes_;
  Box bounds_;
};

}  // namespace nullmark
