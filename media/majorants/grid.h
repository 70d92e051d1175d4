#pragma once

#include <array>

#include "media/majorants/bounds_table.h"
#include "media/majorants/crossing.h"
#include "media/majorants/lattice_walk.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// A regular grid of bounds over the medium's local box, walked by 3D-DDA [Amanatides and Woo 1987; Szirmay-Kalos, Toth, Magdics
/// 2011].  Each cell holds the extrema of the extinction inside it, for trilinear volumes over the whole filter footprint (the
/// medium's `extrema` sees to that).
class GridMajorant final : public MajorantStructure {
 public:
  GridMajorant(const Medium& medium, const std::array<int, 3>& resolution, Real looseness, Crossing crossing = Crossing::carry);

  void segments(const Ray& world, const Ray& local, SegmentBuffer& out) const override;
  std::unique_ptr<Traversal> traversal() const override;
  Crossing crossing() const override { return crossing_; }
  StructureSize size() const override { return {cells_.cells(), 0, sizeof *this + cells_.bytes()}; }

  /// Where a walk along a ray stands.
  struct Walk {
    Ray local;
    LatticeWalk steps;
  };
  void start(Walk& walk, const Ray& world, const Ray& local) const;
  template <class Visit>
  bool walk(Walk& walk, const Visit& visit) const;
  Real rate(std::size_t cell) const { return looseness_ * cells_.largest(cell); }

 private:
  Real looseness_, diagonal_ = 0;
  Crossing crossing_;
  Lattice lattice_;
  BoundsTable cells_;
};

struct GridMajorantSource final : MajorantSource {
  static constexpr const char* kName = "grid";
  static constexpr const char* kSummary = "a regular grid of bounds, walked by 3D-DDA";
  static constexpr const char* kSource = "Amanatides and Woo 1987; Szirmay-Kalos, Toth, Magdics 2011";

  int resolution = 16, resolution_y = 0, resolution_z = 0;
  Real looseness = 1;
  CrossingChoice crossing;

  void parameters(ParameterVisitor& visit) override {
    visit.integer("resolution", resolution, 1, 512, "cells along x, and along the other axes where they are not given");
    visit.integer("resolution_y", resolution_y, 0, 512, "cells along y; 0: as along x");
    visit.integer("resolution_z", resolution_z, 0, 512, "cells along z; 0: as along x");
    visit.number("looseness", looseness, Range::positive(), "", "majorant over least bound; below 1 the majorant is violated");
    crossing.parameters(visit);
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    return std::make_unique<GridMajorant>(
        *medium, std::array{resolution, resolution_y ? resolution_y : resolution, resolution_z ? resolution_z : resolution},
        looseness, crossing.chosen());
  }
};

}  // namespace nullmark
