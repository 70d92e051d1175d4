#pragma once

#include "estimators/walk/event.h"
#include "media/base/value.h"

namespace nullmark {

/// One event of three, `escape` for a null collision, by one number u in [0, 1) and their chances, not all 0 and not normalised.
/// Rounding never picks a chance of 0.
inline EventKind choose_event(Real u, Real absorb, Real scatter, Real null) {
  const Real at = u * (absorb + scatter + null);
  if (at < absorb || !(scatter + null > 0)) return EventKind::absorb;
  if (at < absorb + scatter || !(null > 0)) return EventKind::scatter;
  return EventKind::escape;
}

/// mu_a, mu_s and mu_n = mub - mu at a point.
template <class Value>
struct Coefficients {
  Value absorb, scatter, null;

  Coefficients(const Value& extinction, const Value& albedo, Real mub)
      : absorb((1 - albedo) * extinction), scatter(albedo * extinction), null(mub - extinction) {}

  const Value& of(EventKind kind) const {
    return kind == EventKind::absorb ? absorb : kind == EventKind::scatter ? scatter : null;
  }
};

}  // namespace nullmark
