#pragma once

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "harness/sampling/theory.h"

namespace nullmark {

/// A cell and everything needed to sample it; `reason` is set if it cannot run, `failure` if its tracker threw.
struct PreparedCell {
  const Cell* cell = nullptr;
  std::size_t index = 0;
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const EstimatorSource> source;  ///< null if nothing of the estimator was built
  std::shared_ptr<const Kernel> kernel;
  std::shared_ptr<const Kernel> subtracted;  ///< of the tracker that `kernel` subtracts; null where none is
  std::string reason, failure;
  std::vector<std::string> effects;  ///< of a radiance kernel
  bool takes_part = true;            ///< false: flights are closed forms, and the estimator is not used
  Targets targets;
  CellTheory theory;
  bool theory_later = false;  ///< `add_theory` leaves the cell to `take_theory`
  std::uint64_t samples_per_ray = 0;
  Guarantee claim = Guarantee::unbiased;
  SampleRange range = SampleRange::any_sign;
  bool needs_bound = false;

  Cell planned() const {
    Cell planned = *cell;
    planned.samples_per_ray = samples_per_ray;
    return planned;
  }
};

/// Builds media, majorant structures, rays and references on demand, each once.
class CellPreparer {
 public:
  /// Of more than `most_rays` of a cell it takes so many, evenly: for forecasts.
  explicit CellPreparer(const Plan& plan, std::size_t most_rays = std::numeric_limits<std::size_t>::max())
      : plan_(plan), most_rays_(most_rays) {}

  /// Prepares a cell by its index in the plan, without its theory.  Throws ParameterError (with a JSON pointer as `parameter`)
  /// for specifications that do not fit their medium.  What else a tracker throws is the cell's `failure`.
  PreparedCell prepare(std::size_t index);

  /// Builds those media of cells side by side that are not built.  One that cannot be is told when its cell is prepared.
  void build_media(const std::vector<std::size_t>& cells);

  /// Hash of a medium of the plan and of its data, as records tell it; empty where its data are missing.
  std::string medium_hash(std::size_t medium);

 private:
  void add_kernel(PreparedCell& prepared);
  void add_tracker(PreparedCell& prepared, const Component& tracker);
  void subtract(PreparedCell& prepared, const Component& tracker);
  void add_light(PreparedCell& prepared, const EstimatorSource& source) const;
  std::string why_not(const Cell& cell, const Component& tracker, const Scene& scene, const Kernel* made);
  Real deepest_majorant(const Scene& scene);
  std::shared_ptr<const Scene> scene(const Cell& cell);
  std::shared_ptr<const BuiltMedium> medium(std::size_t index);

  const Plan& plan_;
  std::size_t most_rays_;
  std::map<std::size_t, std::string> missing_;
  std::map<std::size_t, std::shared_ptr<const BuiltMedium>> media_;
  std::map<std::array<std::size_t, 2>, std::shared_ptr<const BuiltMajorant>> structures_;
  std::vector<std::vector<SurfaceSpec>> cuts_;  ///< surfaces that end rays
  std::map<std::array<std::size_t, 3>, std::shared_ptr<const BuiltRays>> rays_;
  std::map<std::array<std::size_t, 3>, std::shared_ptr<const Reference>> references_;
  std::map<std::array<std::size_t, 4>, std::shared_ptr<const Marks>> marks_;
  std::map<std::array<std::size_t, 5>, std::shared_ptr<const Scene>> scenes_;
  std::map<const Scene*, Real> deepest_;  ///< largest majorant depth of a ray, if it was needed
};

/// Whether a tracker of the cell is from outside of nullmark.
bool is_from_outside(const Cell& cell);

/// A cell of which nothing is built yet.
PreparedCell unprepared(const Plan& plan, std::size_t index);

/// Prepares the cells of a plan for whose index `wanted` is true.
/// Once `stop` returns true, those that are left are not prepared: they have neither a scene nor a reason.
std::vector<PreparedCell> prepare_all(
    CellPreparer& preparer, const Plan& plan, const std::function<bool(std::size_t)>& wanted,
    const std::function<bool()>& stop = [] { return false; });

}  // namespace nullmark
