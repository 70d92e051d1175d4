#include "media/majorants/octree.h"

#include <tbb/parallel_for.h>

namespace nullmark {
namespace {

/// A node of size 2^level lattice cells a side, level by level from the lattice's own cells up.
class Octants {
 public:
  Octants(const BoundLattice& lattice, const OctreeOptions& options, Real looseness) : lattice_(lattice), options_(options) {
    if (options.rule == OctreeRule::range) return;
    levels_.resize(static_cast<std::size_t>(options.max_depth) + 1);
    for (int level = 0; level <= options.max_depth; ++level) fill(level, looseness);
  }

  bool splits(int level, const std::array<int, 3>& at) const {
    if (level == 0) return false;
    if (options_.max_depth - level < options_.forced_depth) return true;
    if (options_.rule == OctreeRule::cost) return node(level, at).split;
    const Extrema bounds = lattice_.bounds(block(level, at));
    return (bounds.maximum - bounds.minimum).maxCoeff() * lattice_.diagonal(block(level, at)) >= options_.range_limit;
  }

  std::unique_ptr<Partition> partition(int level, const std::array<int, 3>& at) const {
    if (!splits(level, at)) return std::make_unique<Partition>();
    return halved(level, at, {2 * at[0], 2 * at[1], 2 * at[2]}, 0);
  }

 private:
  /// A split saves this part of the lookups or it is none.
  static constexpr Real kSaved = 1e-9;

  struct Node {
    Real rate = 0;     // bound, 1/length
    Real lookups = 0;  // 4 sum k_i V_i over the leaves below
    Real planes = 0;   // 2 c sum |planes| below
    bool split = false;
  };

  int nodes_across(int level) const { return 1 << (options_.max_depth - level); }
  std::size_t index(int level, const std::array<int, 3>& at) const {
    const auto n = static_cast<std::size_t>(nodes_across(level));
    return (static_cast<std::size_t>(at[2]) * n + static_cast<std::size_t>(at[1])) * n + static_cast<std::size_t>(at[0]);
  }
  const Node& node(int level, const std::array<int, 3>& at) const {
    return levels_[static_cast<std::size_t>(level)][index(level, at)];
  }
  Block block(int level, const std::array<int, 3>& at) const {
    return {{at[0] << level, at[1] << level, at[2] << level}, {(at[0] + 1) << level, (at[1] + 1) << level, (at[2] + 1) << level}};
  }

  void fill(int level, Real looseness) {
    const int n = nodes_across(level);
    std::vector<Node>& nodes = levels_[static_cast<std::size_t>(level)];
    nodes.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
    const Real volume = lattice_.volume(block(level, {0, 0, 0}));
    Real cuts = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) cuts += lattice_.cut(block(level, {0, 0, 0}), axis);
    tbb::parallel_for(0, n * n, [&](int row) {
      for (int x = 0; x < n; ++x) {
        const std::array<int, 3> at{x, row % n, row / n};
        Node& here = nodes[index(level, at)];
        Node parts;
        if (level == 0) {
          here.rate = looseness * lattice_.rates(at[1], at[2])[x];
        } else {
          for (int octant = 0; octant < 8; ++octant) {
            const Node& part =
                node(level - 1, {2 * at[0] + (octant & 1), 2 * at[1] + (octant >> 1 & 1), 2 * at[2] + (octant >> 2)});
            here.rate = std::max(here.rate, part.rate);
            parts.lookups += part.lookups;
            parts.planes += part.planes;
          }
          parts.planes += 2 * options_.crossing_cost * cuts;
        }
        here.lookups = 4 * here.rate * volume;
        if (level == 0) continue;
        here.split =
            parts.lookups < (1 - kSaved) * here.lookups && !(options_.merge_factor * here.lookups < parts.lookups + parts.planes);
        if (!here.split) continue;
        here.lookups = parts.lookups;
        here.planes = parts.planes;
      }
    });
  }

  /// Cuts across axis, axis + 1, ... of a node, whose lower octants along the axes cut so far are `octant`.
  std::unique_ptr<Partition> halved(int level, const std::array<int, 3>& at, std::array<int, 3> octant, std::size_t axis) const {
    if (axis == 3) return partition(level - 1, octant);
    auto part = std::make_unique<Partition>();
    part->axis = axis;
    part->plane = (2 * at[axis] + 1) << (level - 1);
    part->below = halved(level, at, octant, axis + 1);
    ++octant[axis];
    part->above = halved(level, at, octant, axis + 1);
    return part;
  }

  const BoundLattice& lattice_;
  const OctreeOptions& options_;
  std::vector<std::vector<Node>> levels_;
};

std::array<int, 3> finest(const OctreeOptions& options) {
  const int n = 1 << options.max_depth;
  return {n, n, n};
}

}  // namespace

OctreeMajorant::OctreeMajorant(const Medium& medium, const OctreeOptions& options, Real looseness, Crossing crossing)
    : OctreeMajorant(medium, BoundLattice(medium, finest(options)), options, looseness, crossing) {}

OctreeMajorant::OctreeMajorant(const Medium& medium, const BoundLattice& lattice, const OctreeOptions& options, Real looseness,
                               Crossing crossing)
    : TreeMajorant(medium, lattice, *Octants(lattice, options, looseness).partition(options.max_depth, {0, 0, 0}), looseness,
                   crossing) {}

}  // namespace nullmark
