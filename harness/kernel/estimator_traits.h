#pragma once

#include <concepts>
#include <optional>
#include <type_traits>

#include "estimators/estimator.h"
#include "estimators/walk/rng.h"

namespace nullmark {

namespace detail {

/// A tracker's data of a ray: its own RayData, or MediumRay.
template <class E, class Value>
struct RayDataOf {
  using type = MediumRay<Value>;
};
template <class E, class Value>
requires requires { typename E::RayData; }
struct RayDataOf<E, Value> {
  using type = typename E::RayData;
};

/// Defines names_MEMBER<E>: a class has a member function of that name, whatever its signature.  Then a type that derives from it
/// and from another with that name has two of them, and their address is ambiguous; a parameter by that name is a value instead.
#define NULLMARK_NAMES(member)                 \
  struct With_##member {                       \
    int member;                                \
  };                                           \
  template <class E>                           \
  struct Twice_##member : E, With_##member {}; \
  template <class E>                           \
  concept names_##member = !requires {         \
    &Twice_##member<E>::member;                \
  }                                            \
  &&!requires(E & e) { e.member; }
NULLMARK_NAMES(check);
NULLMARK_NAMES(completes);
NULLMARK_NAMES(component);
NULLMARK_NAMES(count_law);
NULLMARK_NAMES(event);
NULLMARK_NAMES(expected);
NULLMARK_NAMES(flies_once);
NULLMARK_NAMES(needs_optical_depth);
NULLMARK_NAMES(optical_depth);
NULLMARK_NAMES(order);
NULLMARK_NAMES(parameters);
NULLMARK_NAMES(prepare);
NULLMARK_NAMES(range);
NULLMARK_NAMES(real_collisions);
NULLMARK_NAMES(samples_events);
NULLMARK_NAMES(theory);
NULLMARK_NAMES(transmittance_at);
NULLMARK_NAMES(weight_theory);
#undef NULLMARK_NAMES

}  // namespace detail

/// The optional members of a tracker E over one type of value; estimator.h has the signatures.
template <class E, class Value>
struct EstimatorTraits {
  using RayData = typename detail::RayDataOf<E, Value>::type;
  using Walk = typename E::Walk;

  static constexpr bool kCheck = requires(const E& e, const MatterBounds& medium) { e.check(medium); };
  static constexpr bool kCompletes = requires(const E& e, const RayData& ray) {
    { e.completes(ray, std::uint32_t{1}) } -> std::same_as<bool>;
  };
  static constexpr bool kComponent = requires(const E& e, const Walk& walk) {
    { e.component(walk) } -> std::convertible_to<int>;
  };
  static constexpr bool kCountLaw = requires(const E& e, const RayData& ray, const RayProfile& profile) {
    { e.count_law(ray, profile, 0) } -> std::convertible_to<CountLaw>;
  };
  static constexpr bool kEvent = requires(const E& e, const Walk& walk, const RayData& ray, const Flight& at) {
    { e.event(walk, ray, at) } -> std::convertible_to<Event<Value>>;
  };
  static constexpr bool kExpected = requires(const E& e, const Value& depth, const RayData& ray) {
    { e.expected(depth, ray) } -> std::convertible_to<Value>;
  };
  static constexpr bool kFliesOnce = requires(const E& e) {
    { e.flies_once(1) } -> std::convertible_to<bool>;
  };
  static constexpr bool kMayNeedOpticalDepth = requires(const E& e) {
    { e.needs_optical_depth() } -> std::convertible_to<bool>;
  };
  static constexpr bool kOpticalDepth = requires(const E& e, const Walk& walk, const RayData& ray) {
    { e.optical_depth(walk, ray) } -> std::convertible_to<Value>;
  };
  static constexpr bool kOrder = requires(const E& e, Quantity quantity) {
    { e.order(quantity) } -> std::convertible_to<Real>;
  };
  static constexpr bool kParameters = requires(E & e, ParameterVisitor& visit) { e.parameters(visit); };
  static constexpr bool kPrepare = requires(const E& e, RayData& ray) { e.prepare(ray); };
  static constexpr bool kRangeByParameters = requires(const E& e) {
    { e.range() } -> std::convertible_to<SampleRange>;
  };
  static constexpr bool kRealCollisions = requires(const E& e, const Walk& walk, const RayData& ray) {
    e.real_collisions(walk, ray);
  };
  static constexpr bool kSamplesEvents = requires(const E& e) {
    { e.samples_events(1) } -> std::convertible_to<bool>;
  };
  static constexpr bool kTheory = requires(const E& e, const RayData& ray, const RayProfile& profile, Quantity quantity) {
    { e.theory(ray, profile, 0, quantity) } -> std::convertible_to<Theory>;
  };
  static constexpr bool kTransmittanceAt = requires(const E& e, const Walk& walk, const RayData& ray) {
    { e.transmittance_at(walk, ray, Real{0}) } -> std::convertible_to<Value>;
  };
  static constexpr bool kWeightTheory = requires(const E& e, const RayData& ray, const RayProfile& profile) {
    { e.weight_theory(ray, profile, 0) } -> std::convertible_to<Theory>;
  };

  static constexpr bool kGreyOnly = requires { E::kGreyOnly; };
  static constexpr bool kIgnoresMajorant = requires { E::kIgnoresMajorant; };
  static constexpr bool kOwnFlights = requires { E::kOwnFlights; };
  static constexpr bool kDrawsExponentials = requires { E::kDrawsExponentials; };
  static constexpr bool kNeedsInversion = requires { E::kNeedsInversion; };
  static constexpr bool kNeedsKnots = requires { E::kNeedsKnots; };
  static constexpr bool kNeedsShares = requires { E::kNeedsShares; };

  /// Whether the tracker needs the exact optical depth of a ray from the harness.
  static bool needs_optical_depth(const E& estimator) {
    if constexpr (kNeedsInversion || requires { E::kNeedsOpticalDepth; }) return true;
    if constexpr (kMayNeedOpticalDepth) return estimator.needs_optical_depth();
    return false;
  }
};

/// A member with the name of an optional one but another signature would compile and never be called.  `message` shows the right
/// signature.
#define NULLMARK_EXPECT_SIGNATURE(member, has, signature) \
  static_assert(!detail::names_##member<E> || has, "a tracker's `" #member "` must be: " signature)

/// Refuses a class that is not a tracker, with one line that shows the expected signature.
template <class E, class Value>
consteval bool expect_estimator() {
  static_assert(
      requires {
        E::kName;
        E::kSummary;
        E::kSource;
      },
      "a tracker needs: static constexpr const char *kName, *kSummary, *kSource");
  static_assert(
      requires {
        { E::kRange } -> std::convertible_to<SampleRange>;
      },
      "a tracker needs: static constexpr SampleRange kRange");
  static_assert(
      requires {
        { E::kNeedsBound } -> std::convertible_to<bool>;
      },
      "a tracker needs: static constexpr bool kNeedsBound");
  static_assert(
      requires(const E& e) {
        { e.claim(Quantity::transmittance) } -> std::convertible_to<Guarantee>;
      },
      "a tracker needs: Guarantee claim(Quantity) const");
  static_assert(
      requires { typename E::Walk; }, "a tracker needs: struct Walk, the state of one sample");
  static_assert(
      !requires { typename E::Ray; }, "a tracker's own data of a ray is called RayData");
  if constexpr (requires { typename E::Walk; }) {
    using Traits = EstimatorTraits<E, Value>;
    using RayData = typename Traits::RayData;
    using Walk = typename E::Walk;
    static_assert(
        requires(const E& e, Walk& walk, const RayData& ray, Flight& flight, Rng& rng) { e.init(walk, ray, flight, rng); },
        "a tracker needs: void init(Walk&, const RayData&, Flight&, auto& rng) const");
    static_assert(
        requires(const E& e, Walk& walk, const RayData& ray, Flight& flight, Rng& rng) {
          { e.propose(walk, ray, flight, rng) } -> std::convertible_to<bool>;
        },
        "a tracker needs: bool propose(Walk&, const RayData&, Flight&, auto& rng) const");
    static_assert(
        requires(const E& e, Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, Rng& rng) {
          e.consume(walk, ray, at, extinction, rng);
        },
        "a tracker needs: void consume(Walk&, const RayData&, const Flight&, const Value& extinction, auto& rng) const");
    static_assert(
        requires(const E& e, const Walk& walk, const RayData& ray) {
          { e.result(walk, ray) } -> std::convertible_to<Value>;
        },
        "a tracker needs: Value result(const Walk&, const RayData&) const");
    NULLMARK_EXPECT_SIGNATURE(check, Traits::kCheck, "void check(const MatterBounds& medium) const");
    NULLMARK_EXPECT_SIGNATURE(completes, Traits::kCompletes, "bool completes(const auto& ray, std::uint32_t lookups) const");
    NULLMARK_EXPECT_SIGNATURE(component, Traits::kComponent, "int component(const Walk&) const");
    NULLMARK_EXPECT_SIGNATURE(count_law, Traits::kCountLaw,
                              "CountLaw count_law(const RayData&, const RayProfile&, int channel) const");
    NULLMARK_EXPECT_SIGNATURE(event, Traits::kEvent, "Event<Value> event(const Walk&, const RayData&, const Flight& at) const");
    NULLMARK_EXPECT_SIGNATURE(expected, Traits::kExpected, "Value expected(const Value& depth, const RayData&) const");
    NULLMARK_EXPECT_SIGNATURE(flies_once, Traits::kFliesOnce, "bool flies_once(int channels) const");
    NULLMARK_EXPECT_SIGNATURE(needs_optical_depth, Traits::kMayNeedOpticalDepth, "bool needs_optical_depth() const");
    NULLMARK_EXPECT_SIGNATURE(optical_depth, Traits::kOpticalDepth, "Value optical_depth(const Walk&, const RayData&) const");
    NULLMARK_EXPECT_SIGNATURE(order, Traits::kOrder, "Real order(Quantity) const");
    NULLMARK_EXPECT_SIGNATURE(parameters, Traits::kParameters, "void parameters(ParameterVisitor&)");
    NULLMARK_EXPECT_SIGNATURE(prepare, Traits::kPrepare, "void prepare(RayData&) const");
    NULLMARK_EXPECT_SIGNATURE(range, Traits::kRangeByParameters, "SampleRange range() const");
    NULLMARK_EXPECT_SIGNATURE(real_collisions, Traits::kRealCollisions, "int real_collisions(const Walk&, const RayData&) const");
    NULLMARK_EXPECT_SIGNATURE(samples_events, Traits::kSamplesEvents, "bool samples_events(int channels) const");
    NULLMARK_EXPECT_SIGNATURE(theory, Traits::kTheory,
                              "Theory theory(const RayData&, const RayProfile&, int channel, Quantity) const");
    NULLMARK_EXPECT_SIGNATURE(transmittance_at, Traits::kTransmittanceAt,
                              "Value transmittance_at(const Walk&, const RayData&, Real distance) const");
    NULLMARK_EXPECT_SIGNATURE(weight_theory, Traits::kWeightTheory,
                              "Theory weight_theory(const RayData&, const RayProfile&, int channel) const");
  }
  return true;
}
#undef NULLMARK_EXPECT_SIGNATURE

}  // namespace nullmark
