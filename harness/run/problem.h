#pragma once

#include <string>
#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// The first key of problem.json.
inline constexpr const char* kProblemVersion = "problem/1";

struct ProblemOptions {
  std::string folder;
  int resolution = 64;   ///< voxels across, of media that are no volumes
  bool answers = false;  ///< write the exact values as well
  bool force = false;    ///< write into a folder that is not empty
};

/// Writes what the author of a renderer needs to draw samples elsewhere: problem.json, volumes/, rays/, README.md and, if asked
/// for, answers/.  One scene for each distinct medium, ray set and quantity of the plan, transmittances and optical depths alone.
/// Returns what was left out, one line each.  Throws InputError.
std::vector<std::string> write_problem(const Plan& plan, const ProblemOptions& options);

/// One scene of a problem, as `judge` needs it.
class ProblemScene {
 public:
  /// The scene of this id; the only one where the id is empty.  Throws InputError.
  static ProblemScene read(const std::string& folder, const std::string& id);

  /// A plan of one cell: the scene, with an estimator as in a configuration, and so many samples of each ray and no more.
  /// `file` stands for the configuration in messages, and the estimator's paths are relative to its folder.
  Plan plan(const std::string& estimator, std::uint64_t samples_per_ray, const std::string& file) const;
  /// The same with a tracker of nullmark, to build the scene with.
  Plan plan() const;

  const std::string& id() const { return id_; }

 private:
  std::string id_, folder_;
  std::string config_;  ///< JSON
};

}  // namespace nullmark
