#pragma once

#include "media/majorants/crossing.h"
#include "media/majorants/register_majorant.h"
#include "media/majorants/tree.h"

namespace nullmark {

/// How a kd-tree of bounds is cut.
struct KdTreeOptions {
  std::array<int, 3> resolution{64, 64, 64};  ///< of the lattice whose planes are candidates
  int max_depth = 40, forced_depth = 0, lookahead = 0;
  Real crossing_cost = 1;
};

/// A kd-tree of bounds [Yue et al. 2010].  Their one-dimensional criterion cuts [s,t] with bound k at q into parts with bounds
/// k1, k2 where (k - k1)(q - s) + (k - k2)(t - q) > 1: the lookups saved pay for the one crossing.  In three dimensions, over
/// isotropic uniform lines, mean chords are 4V/S and mean crossings of a plane 2A/S [Yue et al. 2011], so a cut of area A into
/// volumes V1, V2 (world units) gains
///
///   (4 (k - k1) V1 + 4 (k - k2) V2 - 2 c A) / S
///
/// lookups a line, with c the cost of a crossing over that of a lookup; on a slab of thickness L = V/A this is the criterion
/// above, with lengths doubled by the lines' obliquity.  Every node takes the best of all lattice planes and becomes a leaf where
/// none gains, so homogeneous media are never cut; k includes the looseness.  Ties go to the plane nearest to the middle, then to
/// the lower axis.  A single cut cannot gain where maxima stand everywhere, however much many cuts would save: with `lookahead` n
/// > 0 up to n cuts in a row may lose, and are taken back where the subtree costs no less than the leaf.  Above `forced_depth`
/// the best plane is taken even at a loss.
class KdTreeMajorant final : public TreeMajorant {
 public:
  KdTreeMajorant(const Medium& medium, const KdTreeOptions& options, Real looseness, Crossing crossing = Crossing::carry)
      : KdTreeMajorant(medium, BoundLattice(medium, options.resolution), options, looseness, crossing) {}

 private:
  KdTreeMajorant(const Medium& medium, const BoundLattice& lattice, const KdTreeOptions& options, Real looseness,
                 Crossing crossing);
};

/// Gain, in lookups times S, of the best cut of a block, with its axis and plane; and what the block costs uncut, 4 k V.
struct KdCut {
  Real uncut = 0;
  Real gain = -kInfinity;
  std::size_t axis = 0;
  int plane = 0;
  int off_centre = 0;  ///< twice the distance from the middle, in lattice cells
};

/// A gain of -inf where the block is a single lattice cell.
KdCut best_kd_cut(const BoundLattice& lattice, const Block& block, Real looseness, Real crossing_cost);

struct KdTreeSource final : MajorantSource {
  static constexpr const char* kName = "kd_tree";
  static constexpr const char* kSummary = "a kd-tree of bounds, cut where the saved lookups outweigh the added crossings";
  static constexpr const char* kSource = "Yue et al. 2010; Yue et al. 2011 for the cost in three dimensions";

  int resolution = 64, resolution_y = 0, resolution_z = 0;
  int max_depth = 40, forced_depth = 0, lookahead = 0;
  Real crossing_cost = 1, looseness = 1;
  CrossingChoice crossing;

  void parameters(ParameterVisitor& visit) override {
    visit.integer("resolution", resolution, 1, 256, "candidate planes + 1 along x, and along the other axes where not given");
    visit.integer("resolution_y", resolution_y, 0, 256, "candidate planes + 1 along y; 0: as along x");
    visit.integer("resolution_z", resolution_z, 0, 256, "candidate planes + 1 along z; 0: as along x");
    visit.integer("max_depth", max_depth, 0, TreeMajorant::kDeepest, "cuts from the root to a leaf, at most");
    visit.integer("forced_depth", forced_depth, 0, 16, "nodes above this depth are cut even at a loss");
    visit.integer("lookahead", lookahead, 0, TreeMajorant::kDeepest, "cuts in a row that may lose before others repay them");
    visit.number("crossing_cost", crossing_cost, Range::non_negative(), "", "cost of a crossing over that of a lookup");
    visit.number("looseness", looseness, Range::positive(), "", "majorant over least bound; below 1 the majorant is violated");
    crossing.parameters(visit);
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    const KdTreeOptions options{{resolution, resolution_y ? resolution_y : resolution, resolution_z ? resolution_z : resolution},
                                max_depth,
                                forced_depth,
                                lookahead,
                                crossing_cost};
    return std::make_unique<KdTreeMajorant>(*medium, options, looseness, crossing.chosen());
  }
};

}  // namespace nullmark
