#include "media/majorants/tree.h"

#include <tbb/parallel_for.h>

#include "media/majorants/list_cells.h"

namespace nullmark {

TreeMajorant::TreeMajorant(const Medium& medium, const BoundLattice& lattice, const Partition& partition, Real looseness,
                           Crossing crossing)
    : looseness_(looseness), crossing_(crossing) {
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

  cells_ = BoundsTable(medium.channels(), blocks.size());
  diagonals_.resize(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    // Both are bounds: the medium's own over the cell, and those of the lattice, which the partition was chosen by.
    const Extrema parts = lattice.bounds(blocks[i]);
    Extrema whole = medium.extrema(lattice.bounded_box(blocks[i]));
    whole.minimum = whole.minimum.max(parts.minimum);
    whole.maximum = whole.maximum.min(parts.maximum);
    whole.average = whole.average.max(whole.minimum).min(whole.maximum);
    cells_.put(i, whole);
    diagonals_[i] = lattice.diagonal(blocks[i]);
  });
  Real lookups = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) lookups += rate(i) * lattice.volume(blocks[i]);
  cost_ = (4 * lookups + 2 * cuts) / lattice.surface(lattice.whole());
}

void TreeMajorant::start(Walk& walk, const Ray& world, const Ray& local) const {
  walk.local = local;
  walk.from = world.begin;
  walk.end = world.end;
  walk.at = 0;
  walk.waiting = 0;
  walk.ended = !(world.length() > 0);
}

template <class Visit>
bool TreeMajorant::walk(Walk& walk, const Visit& visit) const {
  while (!walk.ended) {
    const Node& node = nodes_[walk.at];
    if (node.axis == kCell) {
      const Real end = walk.end;
      walk.ended = walk.waiting == 0;
      if (!walk.ended) {
        walk.from = end;
        walk.at = walk.pending[--walk.waiting].node;
        walk.end = walk.pending[walk.waiting].end;
      }
      if (!visit(end, node.first)) return true;
      continue;
    }
    const Real origin = walk.local.origin[node.axis], direction = walk.local.direction[node.axis];
    if (direction == 0) {
      walk.at = node.first + (origin < node.plane ? 0 : 1);
      continue;
    }
    const Real crossing = (node.plane - origin) / direction;
    const std::uint32_t near = node.first + (direction > 0 ? 0 : 1), far = node.first + (direction > 0 ? 1 : 0);
    // Strict on both sides, so that no segment is empty.
    if (!(crossing > walk.from)) {
      walk.at = far;
    } else if (!(crossing < walk.end)) {
      walk.at = near;
    } else {
      walk.pending[walk.waiting++] = {far, walk.end};
      walk.at = near;
      walk.end = crossing;
    }
  }
  return false;
}

void TreeMajorant::segments(const Ray& world, const Ray& local, SegmentBuffer& out) const {
  list_cells(
      *this, world, local, out, [&](std::size_t cell) { return cells_[cell]; },
      [&](std::size_t cell) { return diagonals_[cell]; });
}

std::unique_ptr<Traversal> TreeMajorant::traversal() const { return std::make_unique<CellTraversal<TreeMajorant>>(*this); }

}  // namespace nullmark
