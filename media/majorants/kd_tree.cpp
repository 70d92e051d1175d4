#include "media/majorants/kd_tree.h"

#include <tbb/parallel_invoke.h>

namespace nullmark {
namespace {

/// Below so many lattice cells a task costs more than it saves.
constexpr std::int64_t kFewCells = 4096;

/// A subtree that begins with a loss is kept where it saves this part of the leaf's cost.
constexpr Real kSaved = 1e-9;

struct Subtree {
  std::unique_ptr<Partition> part = std::make_unique<Partition>();
  Real cost = 0;  // lookups and crossings, times S
};

/// `patience`: how many losing cuts in a row are still allowed.
Subtree cut(const BoundLattice& lattice, const Block& block, const KdTreeOptions& options, Real looseness, int depth,
            int patience) {
  Subtree result;
  const KdCut best = best_kd_cut(lattice, block, looseness, options.crossing_cost);
  result.cost = best.uncut;
  const bool forced = depth < options.forced_depth;
  const bool gains = best.gain > 0;
  if (depth >= options.max_depth || best.gain == -kInfinity || !(gains || forced || patience > 0)) return result;
  const int left = gains || forced ? options.lookahead : patience - 1;
  Subtree below, above;
  const auto build_below = [&] { below = cut(lattice, block.below(best.axis, best.plane), options, looseness, depth + 1, left); };
  const auto build_above = [&] { above = cut(lattice, block.above(best.axis, best.plane), options, looseness, depth + 1, left); };
  if (block.cells() > kFewCells) {
    tbb::parallel_invoke(build_below, build_above);
  } else {
    build_below();
    build_above();
  }
  const Real cost = below.cost + above.cost + 2 * options.crossing_cost * lattice.cut(block, best.axis);
  if (!(gains || forced) && !(cost < (1 - kSaved) * best.uncut)) return result;
  result.cost = cost;
  result.part->axis = best.axis;
  result.part->plane = best.plane;
  result.part->below = std::move(below.part);
  result.part->above = std::move(above.part);
  return result;
}

}  // namespace

KdCut best_kd_cut(const BoundLattice& lattice, const Block& block, Real looseness, Real crossing_cost) {
  std::array<std::vector<Real>, 3> slab;  // bounds of the lattice's slabs across each axis
  for (std::size_t axis = 0; axis < 3; ++axis) slab[axis].assign(static_cast<std::size_t>(block.extent(axis)), 0);
  const auto width = static_cast<std::size_t>(block.extent(0));
  for (int z = block.lo[2]; z < block.hi[2]; ++z)
    for (int y = block.lo[1]; y < block.hi[1]; ++y) {
      const Real* const row = lattice.rates(y, z) + block.lo[0];
      Real most = 0;
      for (std::size_t x = 0; x < width; ++x) {
        slab[0][x] = std::max(slab[0][x], row[x]);
        most = std::max(most, row[x]);
      }
      Real &across_y = slab[1][static_cast<std::size_t>(y - block.lo[1])],
           &across_z = slab[2][static_cast<std::size_t>(z - block.lo[2])];
      across_y = std::max(across_y, most);
      across_z = std::max(across_z, most);
    }
  const Real k = *std::max_element(slab[0].begin(), slab[0].end());
  KdCut best;
  best.uncut = 4 * looseness * k * lattice.volume(block);
  std::vector<Real> above;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t n = slab[axis].size();
    above = slab[axis];
    for (std::size_t i = n - 1; i-- > 0;) above[i] = std::max(above[i], above[i + 1]);
    const Real crossing = 2 * crossing_cost * lattice.cut(block, axis);
    const Real slab_volume = lattice.volume(block) / static_cast<Real>(n);
    Real below = 0;
    for (std::size_t i = 1; i < n; ++i) {
      below = std::max(below, slab[axis][i - 1]);
      const Real saved = (k - below) * static_cast<Real>(i) + (k - above[i]) * static_cast<Real>(n - i);
      const Real gain = 4 * looseness * saved * slab_volume - crossing;
      const int off_centre = std::abs(2 * static_cast<int>(i) - static_cast<int>(n));
      if (gain > best.gain || (gain == best.gain && off_centre < best.off_centre))
        best = {best.uncut, gain, axis, block.lo[axis] + static_cast<int>(i), off_centre};
    }
  }
  return best;
}

KdTreeMajorant::KdTreeMajorant(const Medium& medium, const BoundLattice& lattice, const KdTreeOptions& options, Real looseness,
                               Crossing crossing)
    : TreeMajorant(medium, lattice, *cut(lattice, lattice.whole(), options, looseness, 0, options.lookahead).part, looseness,
                   crossing) {}

}  // namespace nullmark
