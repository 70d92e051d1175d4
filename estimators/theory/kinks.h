#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "estimators/theory/ray_profile.h"
#include "estimators/walk/flight.h"

namespace nullmark {

/// The extinction of a profile on panels with these cuts, in any order, and pieces.
inline RayProfile cut_anew(const RayProfile& profile, std::vector<Real> cuts, const Rates& pieces) {
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  std::vector<Real> ends, rates;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    ends.push_back(pieces.end(i));
    rates.push_back(pieces.rate(i));
  }
  return RayProfile([&profile](const Real* t, std::size_t count, Real* mu) { profile.extinction(t, count, mu); },
                    profile.channels(), cuts, ends, rates);
}

/// Appends the distances at which yes(t, piece, mu_c(t)) changes within a piece.
template <class Yes>
void append_changes(const RayProfile& profile, int c, const Yes& yes, std::vector<Real>& cuts) {
  std::vector<Real> out(static_cast<std::size_t>(profile.channels()));
  const std::vector<RayProfile::Node>& nodes = profile.nodes(c);
  for (std::size_t j = 1; j < nodes.size(); ++j) {
    const RayProfile::Node &before = nodes[j - 1], &after = nodes[j];
    if (before.piece != after.piece) continue;
    const bool at_end = yes(after.t, after.piece, after.extinction);
    if (yes(before.t, before.piece, before.extinction) == at_end) continue;
    Real low = before.t, high = after.t;
    for (Real middle = (low + high) / 2; middle > low && middle < high; middle = (low + high) / 2) {
      profile.extinction(&middle, 1, out.data());
      (yes(middle, after.piece, out[static_cast<std::size_t>(c)]) == at_end ? high : low) = middle;
    }
    cuts.push_back(high);
  }
}

/// The profile of a grey medium cut once more where yes(t, piece, mu(t)) changes.
template <class Yes>
RayProfile cut_at_changes(const RayProfile& profile, const Rates& pieces, const Yes& yes) {
  std::vector<Real> cuts(profile.cuts().begin(), profile.cuts().end());
  const std::size_t before = cuts.size();
  append_changes(profile, 0, yes, cuts);
  return cuts.size() == before ? profile : cut_anew(profile, std::move(cuts), pieces);
}

/// The profile cut once more where an extinction crosses a level that is constant on each piece of the rates: theories with
/// absolute values of differences bend there.  The profile itself is returned where none does, as under true bounds.
inline RayProfile cut_at_levels(const RayProfile& profile, const Rates& pieces, std::span<const Rates* const> levels) {
  std::vector<Real> cuts(profile.cuts().begin(), profile.cuts().end());
  const std::size_t before = cuts.size();
  for (int c = 0; c < profile.channels(); ++c)
    for (const Rates* level : levels)
      append_changes(
          profile, c, [level](Real, std::size_t piece, Real mu) { return mu > level->rate(piece); }, cuts);
  return cuts.size() == before ? profile : cut_anew(profile, std::move(cuts), pieces);
}

inline RayProfile cut_at_levels(const RayProfile& profile, const Rates& pieces, std::initializer_list<const Rates*> levels) {
  return cut_at_levels(profile, pieces, std::span(levels.begin(), levels.size()));
}

}  // namespace nullmark
