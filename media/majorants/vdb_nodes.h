#pragma once

#include "media/majorants/bounds_table.h"
#include "media/majorants/crossing.h"
#include "media/majorants/lattice_walk.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {

/// Bounds over the nodes in which a volume stores its values [Museth 2013]: leaves of 8^3 voxels, and above them nodes of 128^3.
/// A node that holds no extinction is one cell, crossed in one step; the others have a bound for each leaf.  Memory goes with the
/// nodes that hold something: 96 KiB each, of a grey volume.
class VdbNodesMajorant final : public MajorantStructure {
 public:
  /// Throws ParameterError where the medium stores no nodes.
  VdbNodesMajorant(const Medium& medium, Real looseness, Crossing crossing = Crossing::carry);

  void segments(const Ray& world, const Ray& local, SegmentBuffer& out) const override;
  std::unique_ptr<Traversal> traversal() const override;
  Crossing crossing() const override { return crossing_; }
  StructureSize size() const override {
    return {cells_.cells(), first_cell_.size(), sizeof *this + cells_.bytes() + first_cell_.size() * sizeof(std::uint32_t)};
  }

  /// Where a walk along a ray stands: between nodes, or between the leaves of one.
  struct Walk {
    Ray local;
    LatticeWalk nodes, leaves;
    Lattice node;  ///< the leaves of the node that the walk is in
    std::uint32_t first = 0;
    bool inside = false;
  };
  void start(Walk& walk, const Ray& world, const Ray& local) const;
  template <class Visit>
  bool walk(Walk& walk, const Visit& visit) const;
  Real rate(std::size_t cell) const { return looseness_ * cells_.largest(cell); }

 private:
  static constexpr int kLeaf = 8, kLeaves = 16;  ///< voxels of a leaf, leaves of a node, along each axis
  static constexpr std::size_t kEmpty = 0;       ///< the cell of all nodes without extinction

  Lattice leaves_of(const std::array<int, 3>& node) const;

  Real looseness_, diagonal_ = 0;
  Crossing crossing_;
  Lattice nodes_;
  std::vector<std::uint32_t> first_cell_;  ///< of each node; kEmpty: it holds nothing
  BoundsTable cells_;
};

struct VdbNodesSource final : MajorantSource {
  static constexpr const char* kName = "vdb_nodes";
  static constexpr const char* kSummary = "bounds over the nodes of a volume: 8^3 voxels, empty ones of 128^3 in one step";
  static constexpr const char* kSource = "Museth 2013, VDB: High-resolution sparse volumes with dynamic topology";

  Real looseness = 1;
  CrossingChoice crossing;

  void parameters(ParameterVisitor& visit) override {
    visit.number("looseness", looseness, Range::positive(), "", "majorant over least bound; below 1 the majorant is violated");
    crossing.parameters(visit);
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    return std::make_unique<VdbNodesMajorant>(*medium, looseness, crossing.chosen());
  }
};

}  // namespace nullmark
