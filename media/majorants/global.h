#pragma once

#include "media/majorants/medium_bounds.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// One segment per ray, bounded over the whole medium.  `looseness` k makes the majorant k times the bound; below 1 it no longer
/// bounds (violations are counted).
class GlobalMajorant final : public MajorantStructure {
 public:
  GlobalMajorant(const Medium& medium, Real looseness)
      : extinction_(medium.extrema(medium.bounds())),
        majorant_(looseness * extinction_.maximum.maxCoeff()),
        diagonal_(world_diagonal(medium, medium.bounds().extent())) {
    expect_finite(majorant_);
  }

  void segments(const Ray& world, const Ray&, SegmentBuffer& out) const override {
    out.clear();
    if (world.length() > 0) out.segments.push_back({world.begin, world.end, majorant_, extinction_, diagonal_});
  }

  StructureSize size() const override { return {1, 0, sizeof *this}; }

 private:
  Extrema extinction_;
  Real majorant_, diagonal_;
};

struct GlobalMajorantSource final : MajorantSource {
  static constexpr const char* kName = "global";
  static constexpr const char* kSummary = "one bound for the whole medium";
  static constexpr const char* kSource = "Woodcock et al. 1965";

  Real looseness = 1;

  void parameters(ParameterVisitor& visit) override {
    visit.number("looseness", looseness, Range::positive(), "", "majorant over least bound; below 1 the majorant is violated");
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    return std::make_unique<GlobalMajorant>(*medium, looseness);
  }
};

}  // namespace nullmark
