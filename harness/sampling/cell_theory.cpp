#include "harness/sampling/cell_theory.h"

#include <fmt/format.h>
#include <tbb/parallel_for_each.h>

#include <cmath>
#include <map>
#include <span>

#include "harness/sampling/failure.h"

namespace nullmark {
namespace {

/// Cells of a scene whose theory is computed together: they share the rays' profiles, and each holds a workspace a thread.
constexpr std::size_t kTheoriesAtOnce = 64;

/// Beyond this a double does not tell two counts of samples apart.
constexpr Real kMostSamples = 0x1p53;

/// As many samples as take the given lookups.
void equalise(PreparedCell& prepared, Real wanted) {
  if (!prepared.theory.lookups || !(*prepared.theory.lookups > 0)) {
    prepared.reason = "equal_lookups needs an estimator and medium with known expected lookups above 0";
    return;
  }
  const Real samples = wanted / *prepared.theory.lookups;
  if (samples <= kMostSamples)
    prepared.samples_per_ray = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(samples)));
  else
    prepared.reason = fmt::format("equal_lookups {:.3g} makes {:.3g} samples a ray of {:.3g} lookups each; expected at most 2^53",
                                  wanted, samples, *prepared.theory.lookups);
}

/// A walk that takes more lookups than the bound is an error of its cell, however long it took to come there.
void refuse_endless(PreparedCell& prepared) {
  static const Real most = Workspace().most_lookups;
  if (prepared.theory.most_lookups > most)
    prepared.reason = fmt::format(
        "a sample is expected to take {:.3g} lookups; at most {:.3g} are allowed: the depth of the majorant "
        "is that large; give a thinner medium or a tighter majorant",
        prepared.theory.most_lookups, most);
  // Where theory cannot resolve so steep an extinction it states no lookups.
  constexpr Real kDeepest = 0x1p40;
  if (!prepared.theory.lookups && prepared.theory.majorant_depth > kDeepest)
    prepared.reason = fmt::format(
        "how many lookups a sample takes is not known, and the majorant's depth is {:.3g}; expected at most 2^40: give a thinner "
        "medium or a tighter majorant",
        prepared.theory.majorant_depth);
}

/// What follows from the theory of a cell.
void follow_theory(PreparedCell& prepared) {
  if (prepared.cell->equal_lookups) equalise(prepared, *prepared.cell->equal_lookups);
  if (prepared.reason.empty()) refuse_endless(prepared);
}

}  // namespace

void add_theory(std::vector<PreparedCell>& cells, const std::function<bool()>& stop) {
  std::map<const Scene*, std::vector<PreparedCell*>> by_scene;
  for (PreparedCell& prepared : cells) {
    const bool plain = prepared.cell->measurement == Measurement{};
    if (prepared.scene && prepared.reason.empty() && plain && !prepared.theory_later && prepared.kernel->states_theory())
      by_scene[prepared.scene.get()].push_back(&prepared);
  }
  std::vector<std::span<PreparedCell* const>> batches;
  for (const auto& [scene, members] : by_scene)
    for (std::size_t first = 0; first < members.size(); first += kTheoriesAtOnce)
      batches.push_back(std::span(members).subspan(first, std::min(kTheoriesAtOnce, members.size() - first)));
  tbb::parallel_for_each(batches.begin(), batches.end(), [&](const auto& members) {
    if (stop()) return;
    const Scene& scene = *members.front()->scene;
    std::vector<TheoryQuery> queries;
    for (const PreparedCell* member : members)
      queries.push_back({member->kernel.get(), member->cell->quantity, member->range, &member->targets, &member->cell->name});
    const std::string failure = tracker_failure([&] {
      const std::vector<CellTheory> theory = compute_theory(scene, queries);
      for (std::size_t i = 0; i < members.size(); ++i) members[i]->theory = theory[i];
    });
    // One of them threw: each by itself shows which.
    for (std::size_t i = 0; i < members.size() && !failure.empty(); ++i)
      members[i]->reason = members[i]->failure =
          tracker_failure([&] { members[i]->theory = compute_theory(scene, {queries[i]})[0]; });
  });
  if (stop()) return;
  for (PreparedCell& prepared : cells)
    if (prepared.reason.empty() && !prepared.theory_later) follow_theory(prepared);
}

void take_theory(PreparedCell& prepared, CellTheory theory) {
  prepared.theory = std::move(theory);
  follow_theory(prepared);
}

}  // namespace nullmark
