#pragma once

#include "media/majorants/crossing.h"
#include "media/majorants/register_majorant.h"
#include "media/majorants/tree.h"

namespace nullmark {

enum class OctreeRule { cost, range };

/// How an octree of bounds is merged or split.
struct OctreeOptions {
  int max_depth = 6, forced_depth = 0;
  OctreeRule rule = OctreeRule::cost;
  Real merge_factor = 1.1, crossing_cost = 1, range_limit = 1.442;
};

/// An octree of bounds over the medium's local box, halved along all three axes at each split.
///
/// `cost` [Yue et al. 2011]: from the finest cells up, eight octants stay merged where merge_factor N_merged < N_split, with
/// N_merged = 4 k V / S and N_split = (4 sum k_i V_i + 2 c sum |planes|) / S over what the octants themselves came to; lengths
/// are the world's, c is the cost of a crossing over that of a lookup, and S cancels.  A factor above 1 favours splits.  Those
/// that lower no bound are never made: at the factor 1.1 the rule alone would split a homogeneous medium once 0.4 k V exceeds
/// twice the planes.
///
/// `range` (production renderers; secondary source): split while (max - min) times the diagonal reaches `range_limit`, in the
/// channel where max - min is largest.
///
/// Above `forced_depth` all nodes are split.
class OctreeMajorant final : public TreeMajorant {
 public:
  OctreeMajorant(const Medium& medium, const OctreeOptions& options, Real looseness, Crossing crossing = Crossing::carry);

 private:
  OctreeMajorant(const Medium& medium, const BoundLattice& lattice, const OctreeOptions& options, Real looseness,
                 Crossing crossing);
};

struct OctreeSource final : MajorantSource {
  static constexpr const char* kName = "octree";
  static constexpr const char* kSummary = "an octree of bounds, merged by expected cost or split by range";
  static constexpr const char* kSource = "Yue et al. 2011";

  static constexpr int kDeepest = 8;

  OctreeOptions options;
  std::string rule = "cost";
  Real looseness = 1;
  CrossingChoice crossing;

  void parameters(ParameterVisitor& visit) override {
    visit.integer("max_depth", options.max_depth, 0, kDeepest, "splits from the root to a leaf, at most");
    visit.integer("forced_depth", options.forced_depth, 0, kDeepest, "nodes above this depth are split whatever it costs");
    visit.choice("rule", rule, {"cost", "range"}, "split by expected cost, or where max - min times the diagonal is large");
    visit.number("merge_factor", options.merge_factor, Range::positive(), "",
                 "octants stay merged where this times N_merged < N_split (cost)");
    visit.number("crossing_cost", options.crossing_cost, Range::non_negative(), "",
                 "cost of a crossing over that of a lookup (cost)");
    visit.number("range_limit", options.range_limit, Range::positive(), "",
                 "(max - min) * diagonal from which nodes split (range)");
    visit.number("looseness", looseness, Range::positive(), "", "majorant over least bound; below 1 the majorant is violated");
    crossing.parameters(visit);
  }
  std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const override {
    OctreeOptions chosen = options;
    chosen.rule = rule == "range" ? OctreeRule::range : OctreeRule::cost;
    return std::make_unique<OctreeMajorant>(*medium, chosen, looseness, crossing.chosen());
  }
};

}  // namespace nullmark
