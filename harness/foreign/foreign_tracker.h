#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "estimators/walk/quantity.h"
#include "harness/foreign/nullmark_tracker.h"
#include "harness/kernel/tracker_failure.h"
#include "media/base/types.h"

namespace nullmark {

/// Bit of a quantity in nullmark_tracker.quantities; 0 where trackers from elsewhere cannot answer it.
std::int32_t bit_of(Quantity quantity);

/// What a tracker says of itself, checked.
struct TrackerDescription {
  Guarantee guarantee = Guarantee::unbiased;
  SampleRange range = SampleRange::any_sign;
  bool needs_bound = false;
  bool own_medium = false;  ///< its lookups are told, not counted
  int streams = NULLMARK_STREAMS_OF_HARNESS;
  Real order = 0;  ///< 0: not stated
};

/// Throws TrackerFailure for a number that stands for nothing.
TrackerDescription checked(const nullmark_description& told);

/// A tracker in the hands of one thread.  All calls throw TrackerFailure.
class TrackerSession {
 public:
  virtual ~TrackerSession() = default;
  virtual void begin_ray(const nullmark_ray&) {}
  /// False where the tracker states none.
  virtual bool theory(const nullmark_ray& ray, std::int32_t quantity, std::int32_t channel, double out[4]) = 0;
  /// NULLMARK_OK, or NULLMARK_STOP where the harness told it to stop.
  /// Of this session so far, what exchanges with a process cost, apart from what the tracker itself does.
  virtual double seam_seconds() const { return 0; }
  virtual std::int32_t sample(const nullmark_ray& ray, const nullmark_harness& harness, std::uint64_t key, std::uint64_t first,
                              std::int64_t count, std::int32_t quantity, nullmark_result& result) = 0;
};

/// A tracker from elsewhere with its parameters: a library that is loaded, or a program that can be started.  Shared by threads.
class ForeignTracker {
 public:
  virtual ~ForeignTracker() = default;
  virtual std::unique_ptr<TrackerSession> session() const = 0;
  /// Throws TrackerFailure if it offers the quantity and does not describe it.
  virtual TrackerDescription describe(std::int32_t quantity, int channels) const = 0;

  std::string name, summary, source, version;
  std::uint64_t hash = 0;  ///< of the library, or of the command and the files it names
  std::uint32_t quantities = 0;
  bool states_theory = false;
  std::size_t block = 512;  ///< most samples of a call

  bool answers(Quantity quantity) const { return (quantities & static_cast<std::uint32_t>(bit_of(quantity))) != 0; }
};

}  // namespace nullmark
