#pragma once

#include "media/majorants/majorant.h"

namespace nullmark {

/// MajorantStructure::segments of a structure that CellTraversal walks.  `bounds(cell)` and `diagonal(cell)` are a segment's
/// other numbers.
template <class Structure, class Bounds, class Diagonal>
void list_cells(const Structure& structure, const Ray& world, const Ray& local, SegmentBuffer& out, const Bounds& bounds,
                const Diagonal& diagonal) {
  out.clear();
  out.crossing = structure.crossing();
  typename Structure::Walk along;
  structure.start(along, world, local);
  Real from = world.begin;
  structure.walk(along, [&](Real end, std::size_t cell) {
    out.segments.push_back({from, end, structure.rate(cell), bounds(cell), diagonal(cell)});
    from = end;
    return true;
  });
}

}  // namespace nullmark
