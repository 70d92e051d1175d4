#pragma once

#include <algorithm>
#include <cstddef>

#include "harness/kernel/kernel.h"
#include "media/base/lanes.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// The majorant audit of all loops: counts a lookup above the bound of its segment, and keeps the largest ratio of the two.
/// Violations are rare, so what they need stays out of the loops.
[[gnu::noinline, gnu::cold]] inline void count_violation(Real extinction, Real bound, Counters& counters) {
  ++counters.violations;
  counters.largest_violation = std::max(counters.largest_violation, extinction / bound);
}
inline void audit_majorant(Real extinction, Real bound, Counters& counters) {
  if (exceeds(extinction, bound)) [[unlikely]]
    count_violation(extinction, bound, counters);
}

/// The largest extinction under a bound that is no violation but rounding.
template <class T, std::size_t N>
Lanes<T, N> largest_allowed(Lanes<T, N> bound) {
  return bound * Lanes<T, N>(1 + kBoundRounding<T>);
}

/// The same for the walks of a register that are `alive`; `allowed` is the bound's.  All of it is inlined: a call would make the
/// loop keep its registers in memory.
template <class T, std::size_t N>
[[gnu::always_inline]] inline void audit_majorant(Lanes<T, N> extinction, Lanes<T, N> bound, Lanes<T, N> allowed,
                                                  LaneMask<T, N> alive, std::uint64_t& violations, Real& largest_violation) {
  LaneMask<T, N> exceeding = extinction > allowed;
  if (none(exceeding)) return;
  exceeding = exceeding & alive;
  violations += count(exceeding);
  const Lanes<T, N> excess = select(exceeding, extinction / bound, Lanes<T, N>(0));
  T ratio[N];
  excess.store(ratio);
  largest_violation = std::max<Real>(largest_violation, *std::max_element(ratio, ratio + N));
}

}  // namespace nullmark
