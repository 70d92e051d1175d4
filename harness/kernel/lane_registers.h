#pragma once

#include <cstddef>
#include <type_traits>

namespace nullmark {

/// Becomes anything.
struct Anything {
  template <class T>
  operator T() const;
};

/// Number of members of an aggregate.
template <class Aggregate, class... Members>
consteval std::size_t member_count() {
  if constexpr (requires { Aggregate{Members()..., Anything()}; })
    return member_count<Aggregate, Members..., Anything>();
  else
    return sizeof...(Members);
}

/// Visits the registers of an aggregate, and of those in it, in their order.
template <class Aggregate, class Visit>
[[gnu::always_inline]] inline void each_register(Aggregate& x, const Visit& visit) {
  if constexpr (requires { x.vector(); }) {
    visit(x);
  } else if constexpr (requires { x.kChannels; }) {
    for (std::size_t c = 0; c < x.kChannels; ++c) visit(x[c]);
  } else {
    static_assert(std::is_aggregate_v<Aggregate>,
                  "a walk in lanes holds Value, Distance<Value>, Truth<Value> and structs of them");
    constexpr std::size_t n = member_count<Aggregate>();
    static_assert(n >= 1 && n <= 6, "a struct of a walk in lanes has one to six members");
    const auto all = [&](auto&... members) __attribute__((always_inline)) { (each_register(members, visit), ...); };
    if constexpr (n == 1) {
      auto& [a] = x;
      all(a);
    } else if constexpr (n == 2) {
      auto& [a, b] = x;
      all(a, b);
    } else if constexpr (n == 3) {
      auto& [a, b, c] = x;
      all(a, b, c);
    } else if constexpr (n == 4) {
      auto& [a, b, c, d] = x;
      all(a, b, c, d);
    } else if constexpr (n == 5) {
      auto& [a, b, c, d, e] = x;
      all(a, b, c, d, e);
    } else {
      auto& [a, b, c, d, e, f] = x;
      all(a, b, c, d, e, f);
    }
  }
}

}  // namespace nullmark
