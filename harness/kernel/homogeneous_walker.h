#pragma once

#include "harness/kernel/walker.h"

namespace nullmark {

/// Flights through constant extinction in closed form: t = -log(1 - u) / mu, no majorant and no lookup.
///
/// On chromatic media the flight is that of a channel chosen with probability p_c proportional to |throughput_c|, and the weight
/// is the balance heuristic over all that could have been chosen: mu_c e^(-mu_c t) / sum_k p_k mu_k e^(-mu_k t), and e^(-mu_c d)
/// / sum_k p_k e^(-mu_k d) where it escapes [Veach and Guibas 1995; Wilkie et al. 2014].  The mean of the weighted throughput
/// over the channels is then that of the throughput before.
template <class Value>
class HomogeneousWalker final : public Walker<Value> {
  struct State final : WalkMemory {
    Real length = 0;
  };

 public:
  explicit HomogeneousWalker(const Value& extinction) : extinction_(extinction) {}

  std::unique_ptr<WalkMemory> memory() const override { return std::make_unique<State>(); }
  bool samples_events(int) const override { return true; }
  bool needs_knots() const override { return false; }
  bool needs_optical_depth() const override { return false; }

  void begin(WalkMemory& memory, const PathScene<Value>&, const Ray& world, const Ray&) const override {
    static_cast<State&>(memory).length = world.end - world.begin;
  }

  Event<Value> fly(WalkMemory& memory, const PathScene<Value>& path_scene, const Value& throughput, Rng& rng, EventBudget&,
                   Counters&) const override {
    const Real length = static_cast<State&>(memory).length;
    if constexpr (std::is_same_v<Value, Real>) {
      const Real t = extinction_ > 0 ? rng.exponential() / extinction_ : kInfinity;
      return t < length ? Event<Value>{EventKind::collision, t, 1} : Event<Value>{EventKind::escape, length, 1};
    } else {
      Value share = throughput.abs();
      share /= share.sum();
      Real rest = rng.uniform();
      int chosen = 0;
      while (chosen + 1 < path_scene.channels && rest >= share[chosen]) rest -= share[chosen++];
      const Real t = extinction_[chosen] > 0 ? rng.exponential() / extinction_[chosen] : kInfinity;
      const bool collides = t < length;
      // Relative to the chosen channel, so that no density underflows.
      Value density = ((extinction_[chosen] - extinction_) * std::min(t, length)).exp();
      if (collides) density *= extinction_;
      return {collides ? EventKind::collision : EventKind::escape, std::min(t, length), density / (share * density).sum()};
    }
  }

  Value transmittance(WalkMemory& memory, const PathScene<Value>&, Rng&, EventBudget&, Counters&) const override {
    return exponential(Value(-extinction_ * static_cast<State&>(memory).length));
  }

 private:
  Value extinction_;
};

}  // namespace nullmark
