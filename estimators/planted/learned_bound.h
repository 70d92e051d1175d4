#pragma once

#include <array>
#include <atomic>
#include <memory>

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that guesses its rate, a quarter of the majorant, and doubles it for all later samples when it meets more than
/// the guess.  Each sample has mean T whatever the guess, since signed weights need no bound.  But it depends on those drawn
/// before it, and so on the number of threads.  It claims no variance and no lookups.
template <class Value>
struct PlantedLearnedBound {
  static constexpr const char* kName = "planted_learned_bound";
  static constexpr const char* kSummary = "wrong: ratio tracking at a rate that it learns from earlier samples";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr const char* kCaughtBy = "replay";

  static constexpr int kGuesses = 3;

  std::shared_ptr<std::atomic<int>> learned = std::make_shared<std::atomic<int>>(0);

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    std::array<Rates, kGuesses> guesses;
  };

  void prepare(RayData& ray) const {
    for (int i = 0; i < kGuesses; ++i) {
      Rates& rates = ray.guesses[static_cast<std::size_t>(i)];
      rates.start(ray.begin, ray.bounds.crossing());
      for (const Segment& segment : ray.bounds.segments())
        rates.append(segment.end, std::ldexp(segment.majorant, i + 1 - kGuesses));
    }
  }

  struct Walk {
    Value weight;
    int guess = 0;
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto&) const {
    walk = {ray.value(1), *learned};
    flight.start(ray.guesses[static_cast<std::size_t>(walk.guess)]);
  }

  bool propose(Walk&, const RayData&, Flight& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const RayData&, const Flight& at, const Value& extinction, auto&) const {
    walk.weight *= (at.rate() - extinction) / at.rate();
    int known = walk.guess;
    if (largest(extinction) > at.rate() && known + 1 < kGuesses) learned->compare_exchange_strong(known, known + 1);
  }

  Value result(const Walk& walk, const RayData&) const { return walk.weight; }
};

}  // namespace nullmark
