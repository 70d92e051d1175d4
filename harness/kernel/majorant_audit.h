#pragma once

#include <algorithm>
#include <cstddef>

#include "harness/kernel/kernel.h"
#include "media/base/lanes.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// The majorant audit of all loops: counts a lookup above the bound of its segment, and keeps the largest ratio of the two.
inline void audit_majorant(Real extinction, Real bound, Counters& counters) {
  if (!exceeds(extinction, bound)) return;
  ++counters.violations;
  counters.largest_violation = std::max(counters.largest_violation, extinction / bound);
}

/// The same for the walks of a register that are `alive`.
template <class T, std::size_t N>
[[gnu::always_inline]] inline void audit_majorant(Lanes<T, N> extinction, Lanes<T, N> bound, LaneMask<T, N> alive,
                                                  Counters& counters) {
  const LaneMask<T, N> exceeding = extinction > bound * Lanes<T, N>(1 + kBoundRounding<T>);
  if (none(exceeding)) return;
  const LaneMask<T, N> violations = exceeding & alive;
  T ratio[N];
  select(violations, extinction / bound, Lanes<T, N>(0)).store(ratio);
  counters.violations += count(violations);
  counters.largest_violation = std::max<Real>(counters.largest_violation, *std::max_element(ratio, ratio + N));
}

}  // namespace nullmark
