#pragma once

#include "media/majorants/medium_bounds.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// One segment per ray: the medium's maximum over the ray's own box, divided by an efficiency eta = max mu/mub that changes
/// linearly along y, from `from` at the lower face to `to` at the upper one (where the ray begins).  For rays along an axis the
/// maximum is that along the ray: the vertical axis of canonical maps.
class RayMaximumMajorant final : public MajorantStructure {
 public:
  RayMaximumMajorant(std::shared_ptr<const Medium> medium, Real from, Real to)
      : medium_(std::move(medium)), from_(from), to_(to), diagonal_(world_diagonal(*medium_, medium_->bounds().extent())) {
    expect_finite(medium_->extrema(medium_->bounds()).maximum.maxCoeff());
  }

  void segments(const Ray& world, const Ray& local, SegmentBuffer& out) const override {
    out.clear();
    if (!(world.length() > 0)) return;
    const Vec3 a = local.at(local.begin), b = local.at(local.end);
    const Extrema extinction = medium_->extrema({a.cwiseMin(b), a.cwiseMax(b)});
    const Box box = medium_->bounds();
    const Real up = std::clamp<Real>((a.y() - box.lo.y()) / box.extent().y(), 0, 1);
    const Real efficiency = from_ + (to_ - from_) * up;
    out.segments.push_back({world.begin, world.end, extinction.maximum.maxCoeff() / efficiency, extinction, diagonal_});
  }

  StructureSize size() const override { return {1, 0, sizeof *this}; }

 private:
  std::shared_ptr<const Medium> medium_;
  Real from_, to_, diagonal_;
};

struct RayMaximumSource final : MajorantSource {
  static constexpr const char* kName = "ray_maximum";
  static constexpr const char* kSummary = "the maximum along each ray, divided by an efficiency that changes along y";
  static constexpr const char* kSource = "Novak et al. 2014 and Georgiev et al. 2019, canonical maps";

  Real from = 0.1, to = 1;

  void parameters(ParameterVisitor& visit) override {
    visit.number("from", from, {0, 1, true}, "", "efficiency max mu/mub at the lower face");
    visit.number("to", to, {0, 1, true}, "", "efficiency at the upper face");
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    return std::make_unique<RayMaximumMajorant>(std::move(medium), from, to);
  }
};

}  // namespace nullmark
