#pragma once

#include <span>
#include <string>
#include <vector>

#include "estimators/walk/flight.h"
#include "harness/foreign/nullmark_tracker.h"
#include "harness/kernel/kernel.h"

namespace nullmark {

/// The harness's side of nullmark_tracker.h: answers and counts lookups, checks them against the majorant, draws random numbers
/// and flights, and ends what should stop.  One thread's; holds no more than one block of samples of one ray.
class SampleHost {
 public:
  SampleHost();
  SampleHost(const SampleHost&) = delete;
  SampleHost& operator=(const SampleHost&) = delete;

  /// `context` must outlive the ray's samples.
  void begin_ray(const Medium& medium, const PreparedRay& context);

  /// Begins samples first .. first + count - 1; `lookups` has an entry for each and is counted up.
  void begin_block(Workspace& workspace, std::uint64_t key, std::uint64_t first, std::size_t count,
                   std::span<std::uint32_t> lookups, Counters& counters);
  /// Adds what the block drew to its counters and recording.
  void end_block();

  /// Records how a free flight ended.
  void record_end(std::size_t sample, EventKind kind, Real distance);

  const nullmark_ray& ray() const { return ray_; }
  const nullmark_harness& calls() const { return calls_; }

  /// Why the tracker's calls were refused; empty if they were not.
  const std::string& misuse() const { return misuse_; }
  /// Whether the block was told to stop: its samples must not be used.
  bool stopped() const { return code_ == NULLMARK_STOP; }

  Rng& rng(std::size_t sample) { return rng_[sample]; }

 private:
  template <class F>
  std::int32_t answer(std::int64_t n, const std::uint32_t* sample, F&& f) noexcept;
  void look_up(std::size_t n, const std::uint32_t* sample, const double* t, double* values);
  void look_up_at(std::size_t n, const std::uint32_t* sample, const double* points, double* values);
  void fly(std::size_t n, const std::uint32_t* sample, double* t, double* rate);
  void audit(std::uint32_t sample, Real t, const double* values);
  void count(std::size_t n, const std::uint32_t* sample);
  bool all_bounded(std::size_t n, const double* values) const;
  void pause(std::size_t lookups);
  void record(std::uint32_t sample, Real t, std::size_t piece, const double* values);
  std::size_t piece_of(std::uint32_t sample, Real t) const;
  Real distance_of(const Vec3& point) const;
  [[noreturn]] void refuse_outside(std::size_t n, const double* t);
  [[noreturn]] void refuse(const std::string& message);

  const Medium* medium_ = nullptr;
  const PreparedRay* context_ = nullptr;
  std::size_t channels_ = 1;
  Affine world_to_local_ = Affine::Identity();
  Rates rates_;
  std::vector<double> ends_, rate_, minimum_, average_, maximum_, albedo_;
  nullmark_ray ray_ = {};
  nullmark_harness calls_ = {};

  Workspace* workspace_ = nullptr;
  Counters* counters_ = nullptr;
  std::span<std::uint32_t> lookups_;
  std::vector<Rng> rng_;
  std::vector<Flight> flight_;
  std::vector<Real> x_, y_, z_, ahead_;
  std::vector<char> outside_;
  std::size_t recorded_before_ = 0;
  std::size_t since_stop_ = 0;
  std::int32_t code_ = NULLMARK_OK;
  std::string misuse_;
};

}  // namespace nullmark
