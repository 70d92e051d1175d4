#pragma once

#include "estimators/walk/event.h"
#include "media/base/value.h"

namespace nullmark {

/// Which of three events a collision was: absorption, scattering, or a null collision.  In lanes it holds one choice per walk.
template <class Truth>
struct EventChoice {
  Truth absorbs = false, scatters = false;  ///< neither: a null collision

  /// Where both are true, absorption is chosen.
  static EventChoice from(const auto& absorbs, const auto& scatters) { return {absorbs, scatters & !absorbs}; }

  /// Whether the walk ends.
  auto ends() const { return !((!absorbs) & (!scatters)); }

  /// The number of the chosen event.
  template <class T>
  T of(const T& absorb, const T& scatter, const T& null) const {
    return select(absorbs, absorb, select(scatters, scatter, null));
  }
};
template <>
struct EventChoice<bool> {
  EventKind kind = EventKind::escape;  ///< escape: a null collision

  static EventChoice from(bool absorbs, bool scatters) {
    return {absorbs ? EventKind::absorb : scatters ? EventKind::scatter : EventKind::escape};
  }

  bool ends() const { return kind != EventKind::escape; }

  template <class T>
  const T& of(const T& absorb, const T& scatter, const T& null) const {
    return kind == EventKind::absorb ? absorb : kind == EventKind::scatter ? scatter : null;
  }
};

/// One event of three by one number u in [0, 1) and their chances, not all 0 and not normalised.  Rounding never picks a chance
/// of 0.
inline EventChoice<bool> choose_event(Real u, Real absorb, Real scatter, Real null) {
  const Real at = u * (absorb + scatter + null);
  if (at < absorb || !(scatter + null > 0)) return {EventKind::absorb};
  if (at < absorb + scatter || !(null > 0)) return {EventKind::scatter};
  return {EventKind::escape};
}
template <class Lane>
auto choose_event(const Lane& u, const Lane& absorb, const Lane& scatter, const Lane& null) {
  const Lane at = u * (absorb + scatter + null), zero(0);
  return EventChoice<Truth<Lane>>::from((at < absorb) | !(scatter + null > zero), (at < absorb + scatter) | !(null > zero));
}

/// mu_a, mu_s and mu_n = mub - mu at a point.
template <class Value>
struct Coefficients {
  Value absorb, scatter, null;

  [[gnu::always_inline]] Coefficients(const Value& extinction, const Value& albedo, const Distance<Value>& mub)
      : absorb((1 - albedo) * extinction), scatter(albedo * extinction), null(mub - extinction) {}

  decltype(auto) of(const auto& event) const { return event.of(absorb, scatter, null); }
};

}  // namespace nullmark
