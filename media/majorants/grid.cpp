#include "media/majorants/grid.h"

#include <tbb/parallel_for.h>

#include "media/majorants/list_cells.h"
#include "media/majorants/medium_bounds.h"

namespace nullmark {

GridMajorant::GridMajorant(const Medium& medium, const std::array<int, 3>& resolution, Real looseness, Crossing crossing)
    : looseness_(looseness),
      crossing_(crossing),
      lattice_{medium.bounds().lo, medium.bounds().extent().cwiseQuotient(Vec3(resolution[0], resolution[1], resolution[2])),
               resolution},
      cells_(medium, lattice_.cells()) {
  diagonal_ = world_diagonal(medium, lattice_.size);
  const Medium& field = BoundsTable::source(medium);
  tbb::parallel_for(std::size_t{0}, cells_.cells(),
                    [&](std::size_t cell) { cells_.put(cell, field.extrema(lattice_.bounded_box(lattice_.cell(cell)))); });
  for (std::size_t cell = 0; cell < cells_.cells(); ++cell) expect_finite(cells_.largest(cell));
}

void GridMajorant::start(Walk& walk, const Ray& world, const Ray& local) const {
  walk.local = local;
  walk.steps.start(lattice_, local, world.begin, world.end);
}

template <class Visit>
bool GridMajorant::walk(Walk& walk, const Visit& visit) const {
  return walk.steps.go_on(lattice_, walk.local, visit);
}

void GridMajorant::segments(const Ray& world, const Ray& local, SegmentBuffer& out) const {
  list_cells(
      *this, world, local, out, [&](std::size_t cell) { return cells_[cell]; }, [&](std::size_t) { return diagonal_; });
}

std::unique_ptr<Traversal> GridMajorant::traversal() const { return std::make_unique<CellTraversal<GridMajorant>>(*this); }

}  // namespace nullmark
