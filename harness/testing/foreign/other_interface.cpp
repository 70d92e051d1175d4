// Libraries that are no tracker of this version: OTHER_ABI has one of a later interface, EMPTY one without trackers.

#include "harness/foreign/nullmark_tracker.h"

#if defined(OTHER_ABI)
const nullmark_tracker* nullmark_get_tracker(int32_t, int32_t) {
  static nullmark_tracker tracker = {};
  tracker.size = sizeof tracker;
  tracker.abi = NULLMARK_ABI + 1;
  tracker.name = "later";
  return &tracker;
}
#elif defined(EMPTY)
const nullmark_tracker* nullmark_get_tracker(int32_t, int32_t) { return nullptr; }
#endif
