#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "media/base/albedo_field.h"
#include "media/base/sum.h"

namespace nullmark {

/// The extinction of any medium, cut to [0, 1], serves as albedo; 0 outside its box.  It has one channel for all, or as many as
/// the medium that it belongs to.
class FieldAlbedo final : public AlbedoField {
 public:
  FieldAlbedo(std::shared_ptr<const Medium> field, int channels) : field_(std::move(field)) {
    if (field_->channels() != 1 && field_->channels() != channels)
      throw ParameterError("albedo", "found a field of " + std::to_string(field_->channels()) + " channels; expected one, or " +
                                         std::to_string(channels) + ", as many as the medium has");
    const Spectrum most = field_->extrema(field_->bounds()).maximum.min(Real{1});
    most_ = most.size() == channels ? most : Spectrum(Spectrum::Constant(channels, most[0]));
  }

  void at(const Vec3& point, int channels, Real* out) const override {
    const Vec3 p = field_->world_to_local() * point;
    const Box box = field_->bounds();
    std::fill_n(out, channels, Real{0});
    if ((p.array() < box.lo.array()).any() || (p.array() > box.hi.array()).any()) return;
    field_->extinction({&p.x(), &p.y(), &p.z(), 1}, out);
    if (field_->channels() == 1) std::fill_n(out, channels, out[0]);
    for (int c = 0; c < channels; ++c) out[c] = std::min<Real>(out[c], 1);
  }

  /// Outside the field's box nothing scatters, and the medium may reach there.
  Spectrum least(int channels) const override { return Spectrum::Zero(channels); }
  Spectrum most(int) const override { return most_; }

  void knots(const Ray& world, std::vector<Real>& t) const override {
    const Affine& to_local = field_->world_to_local();
    field_->knots({to_local * world.origin, to_local.linear() * world.direction, world.begin, world.end}, t);
  }

  std::uint64_t content_hash() const override { return field_->content_hash(); }

 private:
  std::shared_ptr<const Medium> field_;
  Spectrum most_;
};

/// sum_i a_i mu_i / sum_i mu_i for the components of a sum, each with a constant albedo of its own: mu_s = sum_i a_i mu_i.
class SumAlbedo final : public AlbedoField {
 public:
  SumAlbedo(std::shared_ptr<const Sum> medium, Spectrum albedos) : medium_(std::move(medium)), albedos_(std::move(albedos)) {}

  void at(const Vec3& point, int, Real* out) const override {
    const Vec3 p = medium_->world_to_local() * point;
    Real scattering = 0, extinction = 0;
    for (int i = 0; i < medium_->components(); ++i) {
      const Real part = medium_->component_extinction(i, p);
      scattering += albedos_[i] * part;
      extinction += part;
    }
    *out = extinction > 0 ? std::min<Real>(1, scattering / extinction) : 0;
  }

  Spectrum least(int channels) const override { return Spectrum::Constant(channels, albedos_.minCoeff()); }
  Spectrum most(int channels) const override { return Spectrum::Constant(channels, albedos_.maxCoeff()); }

  Spectrum least_absorption(const Spectrum&) const override {
    return Spectrum::Constant(1, ((1 - albedos_) * component_minima()).sum());
  }
  Spectrum least_scattering(const Spectrum&) const override {
    return Spectrum::Constant(1, (albedos_ * component_minima()).sum());
  }

  /// Those of the components are the medium's own.
  void knots(const Ray&, std::vector<Real>&) const override {}

 private:
  Spectrum component_minima() const { return medium_->component_minima(medium_->bounds()); }

  std::shared_ptr<const Sum> medium_;
  Spectrum albedos_;
};

}  // namespace nullmark
