#include "harness/foreign/foreign_tracker.h"

#include <fmt/format.h>

#include <cmath>

namespace nullmark {
namespace {

int within(std::int32_t value, int most, const char* what) {
  if (value >= 0 && value <= most) return value;
  throw TrackerFailure(fmt::format("the tracker describes its {} as {}; expected 0 to {}", what, value, most));
}

}  // namespace

std::int32_t bit_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::transmittance:
      return NULLMARK_TRANSMITTANCE;
    case Quantity::optical_depth:
      return NULLMARK_OPTICAL_DEPTH;
    case Quantity::free_path:
      return NULLMARK_FREE_PATH;
    default:
      return 0;
  }
}

TrackerDescription checked(const nullmark_description& told) {
  TrackerDescription result;
  result.guarantee = static_cast<Guarantee>(within(told.guarantee, NULLMARK_BIASED, "guarantee"));
  result.range = static_cast<SampleRange>(within(told.range, NULLMARK_ANY_SIGN, "range"));
  result.needs_bound = within(told.needs_bound, 1, "need of a bound") != 0;
  result.own_medium = within(told.own_medium, 1, "medium") != 0;
  result.streams = within(told.streams, NULLMARK_STREAMS_FREE, "streams");
  if (!std::isfinite(told.order) || told.order < 0)
    throw TrackerFailure(fmt::format("the tracker describes its order as {}; expected a number >= 0", told.order));
  result.order = told.order;
  return result;
}

}  // namespace nullmark
