#pragma once

#include "estimators/p_series_next_flight.h"

namespace nullmark {

/// The power-series next-flight estimator with P(N > i) where P(N >= i) belongs.
template <class Value>
struct PlantedStrictTail : PowerSeriesNextFlight<Value> {
  static constexpr const char* kName = "planted_strict_tail";
  static constexpr const char* kSummary = "wrong: power series whose terms are divided by the chance to go beyond them";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using RayData = typename PowerSeriesNextFlight<Value>::RayData;

  void consume(typename PowerSeriesNextFlight<Value>::Walk& walk, const RayData& ray, const Flight& at, const Value& extinction,
               auto&) const {
    walk.series.multiply(ray, ray.majorant.total_depth() / at.lookups() * null_ratio(at, extinction));
    walk.series.add(ray.tail.at_least(at.lookups() + 1));
  }
};

}  // namespace nullmark
