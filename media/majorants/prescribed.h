#pragma once

#include "media/majorants/medium_bounds.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// A sampling rate given by the user, mub(p) = value + gradient . p at world points, constant along each ray: the larger of its
/// two ends.  It need not bound the extinction; where it does not, violations are counted.
class PrescribedMajorant final : public MajorantStructure {
 public:
  PrescribedMajorant(const Medium& medium, Real value, const Vec3& gradient)
      : extinction_(medium.extrema(medium.bounds())),
        value_(value),
        gradient_(gradient),
        diagonal_(world_diagonal(medium, medium.bounds().extent())) {
    const Affine to_world = medium.world_to_local().inverse();
    const Box box = medium.bounds();
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p(corner & 1 ? box.hi.x() : box.lo.x(), corner & 2 ? box.hi.y() : box.lo.y(),
                   corner & 4 ? box.hi.z() : box.lo.z());
      // Products of smaller rates underflow.
      constexpr Real kLeast = 1e-300;
      if (const Real rate = value + gradient.dot(to_world * p); !(rate >= kLeast))
        throw ParameterError(gradient.isZero() ? "value" : "gradient",
                             "the majorant falls to " + std::to_string(rate) +
                                 " at a corner of the medium; expected a rate above 0 everywhere, and at least 1e-300");
    }
  }

  void segments(const Ray& world, const Ray&, SegmentBuffer& out) const override {
    out.clear();
    if (!(world.length() > 0)) return;
    const Real rate = value_ + std::max(gradient_.dot(world.at(world.begin)), gradient_.dot(world.at(world.end)));
    out.segments.push_back({world.begin, world.end, std::max<Real>(0, rate), extinction_, diagonal_});
  }

  StructureSize size() const override { return {1, 0, sizeof *this}; }

 private:
  Extrema extinction_;
  Real value_;
  Vec3 gradient_;
  Real diagonal_;
};

struct PrescribedMajorantSource final : MajorantSource {
  static constexpr const char* kName = "prescribed";
  static constexpr const char* kSummary = "a given rate, constant or affine in space, whether or not it is a bound";
  static constexpr const char* kSource = "Kozelj, Comparison of transmittance and distance estimators (majorant 5 + 95 y)";

  Real value = 1;
  Vec3 gradient = Vec3::Zero();

  void parameters(ParameterVisitor& visit) override {
    visit.number("value", value, Range::non_negative(), "1/length", "rate at the world's origin");
    visit.point("gradient", gradient, "1/length^2", "change of the rate per world length");
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    return std::make_unique<PrescribedMajorant>(*medium, value, gradient);
  }
};

}  // namespace nullmark
