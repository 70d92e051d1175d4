#pragma once

#include <memory>

#include "media/base/registry.h"
#include "media/majorants/bound_lattice.h"
#include "media/majorants/bounds_table.h"
#include "media/majorants/crossing.h"

namespace nullmark {

/// A cell of a partition, or the plane that cuts it in two.
struct Partition {
  std::size_t axis = 0;
  int plane = 0;  ///< of the lattice
  std::unique_ptr<Partition> below, above;

  bool is_cell() const { return !below; }
};

/// Bounds over cells that planes across the axes cut out of the medium's local box, as a binary tree of these planes.  Each cell
/// holds the extrema inside it, for trilinear volumes over the whole filter footprint.  Rays walk it front to back.
class TreeMajorant : public MajorantStructure {
 public:
  /// Partitions may be this deep.
  static constexpr int kDeepest = 60;

  void segments(const Ray& world, const Ray& local, SegmentBuffer& out) const final;
  std::unique_ptr<Traversal> traversal() const final;
  Crossing crossing() const final { return crossing_; }

  StructureSize size() const final {
    return {cells_.cells(), nodes_.size(),
            sizeof *this + nodes_.size() * sizeof(Node) + cells_.bytes() + diagonals_.size() * sizeof(Real)};
  }

  /// Where a walk along a ray stands: in the node `at` between `from` and `end`, with nodes behind it that wait.
  struct Walk {
    struct Pending {
      std::uint32_t node;
      Real end;
    };
    Ray local;
    Real from = 0, end = 0;
    std::uint32_t at = 0;
    std::size_t waiting = 0;
    bool ended = true;
    std::array<Pending, kDeepest> pending;
  };
  void start(Walk& walk, const Ray& world, const Ray& local) const;
  template <class Visit>
  bool walk(Walk& walk, const Visit& visit) const;
  Real rate(std::size_t cell) const { return looseness_ * cells_.largest(cell); }

  /// Lookups of ratio tracking plus crossings from cell to cell, averaged over isotropic uniform lines through the world box:
  /// (4 sum k_i V_i + 2 sum |planes|) / S, with k_i, V_i a cell's majorant and volume, |planes| the areas of the cuts and S the
  /// box's surface [Yue et al. 2011].
  Real expected_cost() const { return cost_; }

 protected:
  TreeMajorant(const Medium& medium, const BoundLattice& lattice, const Partition& partition, Real looseness, Crossing crossing);

 private:
  static constexpr std::uint32_t kCell = 3;

  struct Node {
    Real plane = 0;           // local coordinate
    std::uint32_t axis = 0;   // kCell: a leaf
    std::uint32_t first = 0;  // node below the plane, followed by the one above; or index of the cell
  };

  std::vector<Node> nodes_;
  BoundsTable cells_;
  std::vector<Real> diagonals_;
  Real looseness_, cost_ = 0;
  Crossing crossing_;
};

}  // namespace nullmark
