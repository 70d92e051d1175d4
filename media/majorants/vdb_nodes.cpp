#include "media/majorants/vdb_nodes.h"

#include <tbb/parallel_for.h>

#include "media/majorants/list_cells.h"
#include "media/majorants/medium_bounds.h"

namespace nullmark {

VdbNodesMajorant::VdbNodesMajorant(const Medium& medium, Real looseness, Crossing crossing)
    : looseness_(looseness), crossing_(crossing) {
  if (!medium.has_nodes())
    throw ParameterError("type", "the medium is no volume and has no nodes; use \"grid\", \"kd_tree\" or \"octree\"");
  const Box box = medium.bounds();
  nodes_.size = Vec3::Constant(kLeaf * kLeaves);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    nodes_.lo[k] = std::floor(box.lo[k] / nodes_.size[k]) * nodes_.size[k];
    nodes_.resolution[axis] = std::max(1, static_cast<int>(std::ceil((box.hi[k] - nodes_.lo[k]) / nodes_.size[k])));
  }
  diagonal_ = world_diagonal(medium, Vec3::Constant(kLeaf));
  const Medium& field = BoundsTable::source(medium);
  const std::size_t nodes = nodes_.cells();
  first_cell_.assign(nodes, 1);
  tbb::parallel_for(std::size_t{0}, nodes, [&](std::size_t node) {
    const Real most = field.extrema(nodes_.bounded_box(nodes_.cell(node))).maximum.maxCoeff();
    if (most == 0) first_cell_[node] = kEmpty;
  });
  std::uint32_t cells = 1;
  for (std::uint32_t& first : first_cell_)
    if (first != kEmpty) {
      first = cells;
      cells += kLeaves * kLeaves * kLeaves;
    }
  cells_ = BoundsTable(medium, cells);
  cells_.put(kEmpty, field.extrema({box.hi + nodes_.size, box.hi + 2 * nodes_.size}));
  tbb::parallel_for(std::size_t{0}, nodes, [&](std::size_t node) {
    if (first_cell_[node] == kEmpty) return;
    const Lattice leaves = leaves_of(nodes_.cell(node));
    for (std::size_t leaf = 0; leaf < leaves.cells(); ++leaf)
      cells_.put(first_cell_[node] + leaf, field.extrema(leaves.bounded_box(leaves.cell(leaf))));
  });
  for (std::size_t cell = 0; cell < cells; ++cell) expect_finite(cells_.largest(cell));
}

Lattice VdbNodesMajorant::leaves_of(const std::array<int, 3>& node) const {
  return {nodes_.corner(node), Vec3::Constant(kLeaf), {kLeaves, kLeaves, kLeaves}};
}

void VdbNodesMajorant::start(Walk& walk, const Ray& world, const Ray& local) const {
  walk.local = local;
  walk.nodes.start(nodes_, local, world.begin, world.end);
  walk.inside = false;
}

template <class Visit>
bool VdbNodesMajorant::walk(Walk& walk, const Visit& visit) const {
  const auto visit_leaf = [&](Real end, std::size_t leaf) { return visit(end, walk.first + leaf); };
  if (walk.inside && walk.leaves.go_on(walk.node, walk.local, visit_leaf)) return true;
  walk.inside = false;
  for (;;) {
    Real from = walk.nodes.from();
    const bool goes_on = walk.nodes.go_on(nodes_, walk.local, [&](Real end, std::size_t node) {
      const std::uint32_t first = first_cell_[node];
      if (first == kEmpty) {
        from = end;
        return visit(end, kEmpty);
      }
      walk.first = first;
      walk.node = leaves_of(nodes_.cell(node));
      walk.leaves.start(walk.node, walk.local, from, end);
      walk.inside = true;
      return false;
    });
    if (!walk.inside) return goes_on;
    if (walk.leaves.go_on(walk.node, walk.local, visit_leaf)) return true;
    walk.inside = false;
  }
}

void VdbNodesMajorant::segments(const Ray& world, const Ray& local, SegmentBuffer& out) const {
  list_cells(
      *this, world, local, out, [&](std::size_t cell) { return cells_[cell]; }, [&](std::size_t) { return diagonal_; });
}

std::unique_ptr<Traversal> VdbNodesMajorant::traversal() const {
  return std::make_unique<CellTraversal<VdbNodesMajorant>>(*this);
}

}  // namespace nullmark
