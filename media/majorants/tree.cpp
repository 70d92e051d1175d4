#include "media/majorants/tree.h"

#include <tbb/parallel_for.h>

namespace nullmark {

TreeMajorant::TreeMajorant(const Medium& medium, const BoundLattice& lattice, const Partition& partition, Real looseness,
                           Crossing crossing)
    : crossing_(crossing) {
  std::vector<Block> blocks;
  Real cuts = 0;
  const auto place = [&](const auto& self, const Partition& part, const Block& block, std::size_t at) -> void {
    if (part.is_cell()) {
      nodes_[at] = {0, kCell, static_cast<std::uint32_t>(blocks.size())};
      blocks.push_back(block);
      return;
    }
    const std::size_t first = nodes_.size();
    nodes_[at] = {lattice.plane(part.axis, part.plane), static_cast<std::uint32_t>(part.axis), static_cast<std::uint32_t>(first)};
    nodes_.resize(first + 2);
    cuts += lattice.cut(block, part.axis);
    self(self, *part.below, block.below(part.axis, part.plane), first);
    self(self, *part.above, block.above(part.axis, part.plane), first + 1);
  };
  nodes_.resize(1);
  place(place, partition, lattice.whole(), 0);

  cells_.resize(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    // Both are bounds: the medium's own over the cell, and those of the lattice, which the partition was chosen by.
    const Extrema parts = lattice.bounds(blocks[i]);
    Extrema whole = medium.extrema(lattice.bounded_box(blocks[i]));
    whole.minimum = whole.minimum.max(parts.minimum);
    whole.maximum = whole.maximum.min(parts.maximum);
    whole.average = whole.average.max(whole.minimum).min(whole.maximum);
    cells_[i] = {whole, looseness * whole.maximum.maxCoeff(), lattice.diagonal(blocks[i])};
  });
  Real lookups = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) lookups += cells_[i].majorant * lattice.volume(blocks[i]);
  cost_ = (4 * lookups + 2 * cuts) / lattice.surface(lattice.whole());
}

void TreeMajorant::segments(const Ray& world, const Ray& local, SegmentBuffer& out) const {
  out.clear();
  out.crossing = crossing_;
  if (!(world.length() > 0)) return;
  struct Pending {
    std::uint32_t node;
    Real end;
  };
  std::array<Pending, kDeepest> pending;
  std::size_t waiting = 0;
  std::uint32_t at = 0;
  Real from = world.begin, end = world.end;
  for (;;) {
    const Node& node = nodes_[at];
    if (node.axis == kCell) {
      const Cell& cell = cells_[node.first];
      out.segments.push_back({from, end, cell.majorant, cell.extinction, cell.diagonal});
      if (waiting == 0) return;
      from = end;
      at = pending[--waiting].node;
      end = pending[waiting].end;
      continue;
    }
    const Real origin = local.origin[node.axis], direction = local.direction[node.axis];
    if (direction == 0) {
      at = node.first + (origin < node.plane ? 0 : 1);
      continue;
    }
    const Real crossing = (node.plane - origin) / direction;
    const std::uint32_t near = node.first + (direction > 0 ? 0 : 1), far = node.first + (direction > 0 ? 1 : 0);
    // Strict on both sides, so that no segment is empty.
    if (!(crossing > from)) {
      at = far;
    } else if (!(crossing < end)) {
      at = near;
    } else {
      pending[waiting++] = {far, end};
      at = near;
      end = crossing;
    }
  }
}

}  // namespace nullmark
