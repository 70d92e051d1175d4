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

/// The profile cut once more where an extinction crosses a level that is constant on each piece of the rates: theories with
/// absolute values of differences bend there.  The profile itself is returned where none does, as under true bounds.
inline RayProfile cut_at_levels(const RayProfile& profile, const Rates& pieces, std::span<const Rates* const> levels) {
  const auto channels = static_cast<std::size_t>(profile.channels());
  std::vector<Real> cuts(profile.cuts().begin(), profile.cuts().end());
  const std::size_t before = cuts.size();
  std::vector<Real> out(channels);
  for (std::size_t c = 0; c < channels; ++c) {
    const std::vector<RayProfile::Node>& nodes = profile.nodes(static_cast<int>(c));
    for (std::size_t j = 1; j < nodes.size(); ++j)
      for (const Rates* level : levels) {
        const std::size_t piece = nodes[j].piece;
        const Real at = level->rate(piece);
        if (nodes[j - 1].piece != piece || (nodes[j - 1].extinction > at) == (nodes[j].extinction > at)) continue;
        const bool above = nodes[j].extinction > at;
        Real low = nodes[j - 1].t, high = nodes[j].t;
        for (Real middle = (low + high) / 2; middle > low && middle < high; middle = (low + high) / 2) {
          profile.extinction(&middle, 1, out.data());
          ((out[c] > at) == above ? high : low) = middle;
        }
        cuts.push_back(high);
      }
  }
  return cuts.size() == before ? profile : cut_anew(profile, std::move(cuts), pieces);
}

inline RayProfile cut_at_levels(const RayProfile& profile, const Rates& pieces, std::initializer_list<const Rates*> levels) {
  return cut_at_levels(profile, pieces, std::span(levels.begin(), levels.size()));
}

}  // namespace nullmark
