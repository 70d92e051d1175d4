#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "estimators/estimator.h"
#include "estimators/walk/rng.h"

namespace nullmark {

/// One ray prepared for sampling, with data from the medium, the majorant structure and the reference.
struct PreparedRay {
  Ray world, local;  ///< cut to the medium
  std::uint32_t index = 0;
  RayBounds bounds;
  std::vector<Real> knots;                    ///< sorted, with begin and end; filled only when the kernel needs them
  std::optional<Spectrum> exact_depth;        ///< filled only when the kernel needs it
  Spectrum albedo;                            ///< mu_s / mu per channel, its most where it varies; empty: 0
  const AlbedoField* albedo_field = nullptr;  ///< where it varies in space
  std::span<const Real> marks;                ///< distances of a profile or of the bins of a free path, ascending
};

/// Number of distances of a transmittance profile; of bins of a free path; of bins in the tests of its law.
inline constexpr std::size_t kProfileMarks = 8, kFreePathBins = 8, kFreePathCells = 64;

inline bool scatters(const Spectrum& albedo) { return albedo.size() > 0 && albedo.maxCoeff() > 0; }

/// Results of a block of samples of one ray.
struct SampleBlock {
  std::vector<Real> values;            ///< values[i * outputs + o]
  std::vector<std::uint32_t> lookups;  ///< per sample
};

/// Exact event counts.  Addition is associative, so any order of merging gives the same totals.
struct Counters {
  std::uint64_t samples = 0, lookups = 0, null_collisions = 0, draws = 0, violations = 0, overruns = 0;
  Real largest_violation = 0;  ///< max mu / mub beyond 1

  Counters& operator+=(const Counters& other) {
    samples += other.samples;
    lookups += other.lookups;
    null_collisions += other.null_collisions;
    draws += other.draws;
    violations += other.violations;
    overruns += other.overruns;
    largest_violation = std::max(largest_violation, other.largest_violation);
    return *this;
  }
};

/// Recorded walks, one entry per sample in the order drawn, for replay and for tests of laws.
struct Recording {
  struct Step {
    Real position;        ///< of the lookup, world length
    Real depth;           ///< int rate from the ray's begin to it
    Real rate;            ///< of the flight there, 1/length
    std::uint64_t draws;  ///< so far, including those that the lookup led to
  };
  struct Walk {
    std::vector<Step> steps;
    std::vector<Real> extinction;  ///< [step * channels + c]
    Real depth = 0;                ///< where the flight ended
    Real total_depth = 0;          ///< integral of the rates it flew through
    std::uint64_t draws = 0;
    std::uint32_t collisions = 0;       ///< drawn by the flight
    EventKind end = EventKind::escape;  ///< for free-path samplers: how and at which distance the flight ended
    Real distance = 0;
  };
  std::vector<Walk> walks;

  /// Steps of all walks together that memory allows; a block that takes more is aborted and counted as an overrun.
  static constexpr std::uint64_t kMostSteps = 1u << 24;
  std::uint64_t steps = 0;

  /// Adds n walks; reuses memory that `restart` kept.
  void add(std::size_t n) {
    for (; n > 0; --n) {
      walks.emplace_back();
      if (kept_.empty()) continue;
      walks.back() = std::move(kept_.back());
      kept_.pop_back();
    }
  }

  void restart() {
    for (Walk& walk : walks) {
      walk.steps.clear();
      walk.extinction.clear();
      kept_.push_back({std::move(walk.steps), std::move(walk.extinction)});
    }
    walks.clear();
    steps = 0;
  }

 private:
  std::vector<Walk> kept_;
};

/// Scratch memory of one thread.
class Workspace {
 public:
  virtual ~Workspace() = default;
  /// Called now and then, so that endless walks can be interrupted.  Once it returns true, the current block is aborted and its
  /// samples must not be used.
  std::function<bool()> stop = [] { return false; };
  /// Lookups that one walk may take.  A block with a longer walk is aborted and counted as an overrun, which makes the cell an
  /// error: silently cutting the walk short would cause a bias.
  std::uint32_t most_lookups = 1u << 30;
  /// Where walks are recorded; usually null.
  Recording* recording = nullptr;
};

/// An estimator with its parameters, compiled for one kind of value.  Immutable; one instance serves all threads.
class Kernel {
 public:
  virtual ~Kernel() = default;
  virtual bool needs_optical_depth() const = 0;
  virtual bool needs_knots() const = 0;
  virtual bool states_theory() const = 0;
  virtual bool answers(Quantity) const = 0;
  virtual std::unique_ptr<Workspace> workspace() const = 0;

  /// Numbers per sample of a quantity.
  virtual std::size_t outputs(Quantity, const PreparedRay&) const = 0;

  /// Prepares a ray.  Later calls for samples and theory refer to this ray, the medium and its extrema.
  virtual void begin_ray(Workspace&, const Medium&, const Extrema& medium, const PreparedRay&) const = 0;

  /// Draws samples first .. first + count - 1 of the ray.
  virtual void sample(Workspace&, const Medium&, const PreparedRay&, std::uint64_t key, std::uint64_t first, std::size_t count,
                      Quantity, SampleBlock& out, Counters&) const = 0;

  /// Mean of the estimator's target on this ray, given the exact optical depth: T = exp(-tau) or tau, unless it defines another.
  virtual Spectrum expected(const Workspace&, const Spectrum& optical_depth, Quantity quantity) const {
    return quantity == Quantity::transmittance ? Spectrum((-optical_depth).exp()) : optical_depth;
  }

  /// Samples of a ray that a pilot may draw, where there are only so many.
  virtual std::optional<std::uint64_t> pilot_samples() const { return std::nullopt; }

  /// Exact moments per channel; empty if the estimator states none.  For a free path the variance is that of its weight.  For a
  /// profile only lookups are stated.
  virtual std::vector<Theory> theory(const Workspace&, const RayProfile&, Quantity) const = 0;

  /// Whether the walks of a quantity run side by side in registers.
  virtual bool in_lanes(Quantity) const { return false; }

  /// What exchanges with a process have cost this workspace so far, where the tracker lives in one.
  virtual Real seam_seconds(const Workspace&) const { return 0; }

  /// Whether a sample is one flight through a majorant, so that the laws of collisions apply.
  virtual bool flies() const = 0;

  /// Per channel, for estimators that are products (CountLaw).
  virtual bool states_count_law() const { return false; }
  virtual std::vector<CountLaw> count_law(const Workspace&, const RayProfile&) const { return {}; }
};

template <class Value>
class Walker;

/// An estimator as light paths use it: see walker.h.  Null if they cannot.
struct Walkers {
  std::shared_ptr<const Walker<Real>> grey;
  std::shared_ptr<const Walker<Spectrum>> chromatic;  ///< of any number of channels
  std::shared_ptr<const Walker<SpectrumOf<3>>> three;
  std::shared_ptr<const Walker<SpectrumOf<4>>> four;
};

/// What a tracker from outside of nullmark says of itself, for records.
struct TrackerIdentity {
  std::string name, version;
  std::uint64_t hash = 0;      ///< of its code: the library, or the command and the files that it names
  bool tells_lookups = false;  ///< they are of a medium of its own and were not counted here
  bool repeatable = true;      ///< its samples can be drawn again
};

/// An estimator's parameters, before it is combined with a medium.
class EstimatorSource {
 public:
  virtual ~EstimatorSource() = default;
  virtual void parameters(ParameterVisitor& visit) = 0;
  virtual Guarantee claim(Quantity) const = 0;
  virtual SampleRange range(int channels) const = 0;
  virtual bool needs_bound() const = 0;
  /// Convergence order of a consistent estimator; empty if none is stated.
  virtual std::optional<Real> order(Quantity) const = 0;
  /// Throws ParameterError if the parameters do not fit the medium.
  virtual void check(const MatterBounds& medium) const = 0;
  /// Null if there is none in this precision.  `lanes`: walks may run side by side in registers.
  virtual std::unique_ptr<const Kernel> kernel(int channels, Precision precision = Precision::float64,
                                               bool lanes = true) const = 0;
  virtual Walkers walkers() const { return {}; }
  /// The folder that paths among the parameters are relative to.
  virtual void locate(const std::string& /*folder*/) {}
  /// Of a tracker from outside of nullmark.
  virtual std::optional<TrackerIdentity> identity() const { return std::nullopt; }
};

}  // namespace nullmark
