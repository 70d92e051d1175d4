#pragma once

#include "estimators/mis_bidirectional.h"
#include "estimators/mis_unidirectional.h"

namespace nullmark {

/// Unidirectional MIS that counts each vertex's next flight and forgets the escape that shares its weight.
template <class Value>
struct PlantedLostEscape : UnidirectionalMis<Value> {
  static constexpr const char* kName = "planted_lost_escape";
  static constexpr const char* kSummary = "wrong: unidirectional MIS without the escape's share";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  Value result(const typename UnidirectionalMis<Value>::Walk& walk, const auto&) const { return walk.sum; }
};

/// Bidirectional MIS that joins vertices and forgets that each walk may get through by itself.
template <class Value>
struct PlantedLostWalks : BidirectionalMis<Value> {
  static constexpr const char* kName = "planted_lost_walks";
  static constexpr const char* kSummary = "wrong: bidirectional MIS without its whole walks";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  Value result(const typename BidirectionalMis<Value>::Kept& walk, const auto&) const { return walk.joined(); }
};

}  // namespace nullmark
