#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "harness/kernel/kernel.h"
#include "harness/sampling/test_evidence.h"
#include "harness/statistics/moments.h"

namespace nullmark {

/// A range of a cell's samples: first .. first + per_ray - 1 of every ray.
struct SampleSpan {
  std::uint64_t first = 0, per_ray = 0;
  bool only_evidence = false;  ///< leave moments, groups, blocks and squares of lookups empty
  bool keep = false;           ///< keep some values, to draw them again later
};

/// Rays [first_ray, end_ray) with all their samples, or one ray with samples [first, first + count) of the span.
struct Chunk {
  std::size_t first_ray, end_ray;
  std::uint64_t first, count;
};

/// What consecutive chunks add to the statistics of a cell.
struct Portion {
  std::size_t first_ray = 0, end_ray = 0;
  std::vector<Moments> moments;                         ///< [(ray - first_ray) * outputs + o], errors around the measured target
  std::vector<std::uint64_t> lookups, null_collisions;  ///< per ray
  std::vector<Real> lookups_squared;                    ///< per ray, sum over the samples
  std::vector<Real> chunk_sums;                         ///< [chunk * outputs + o], errors of the last ray of each chunk
  std::vector<GroupErrors> groups;                      ///< per output
  std::vector<BlockErrors> blocks;                      ///< per output
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  Real largest = 0;                                     ///< max |X| of the finite samples
  std::map<std::size_t, Evidence> evidence, variances;  ///< by test; a chunk touches few of them
  std::vector<Real> kept;                               ///< values of its kept samples, see KeptSamples
  /// Time of all threads: for evidence; for all statistics of drawn samples; in total.
  double judging_seconds = 0, statistics_seconds = 0, working_seconds = 0;

  /// Adds the chunks that follow.
  void append(const Portion& next);
};

/// Adds what a portion holds once for all of its rays.
template <class Sums>
void add_what_rays_share(const Portion& more, Sums& sums) {
  for (std::size_t o = 0; o < more.groups.size(); ++o) {
    sums.groups[o] += more.groups[o];
    sums.blocks[o] += more.blocks[o];
  }
  sums.counters += more.counters;
  sums.nonfinite += more.nonfinite;
  sums.out_of_range += more.out_of_range;
  sums.largest = std::max(sums.largest, more.largest);
  for (const auto& [test, evidence] : more.evidence) sums.evidence[test] += evidence;
  for (const auto& [test, evidence] : more.variances) sums.variances[test] += evidence;
  sums.judging_seconds += more.judging_seconds;
  sums.statistics_seconds += more.statistics_seconds;
  sums.working_seconds += more.working_seconds;
}

/// The chunks of a span, and the portions that are made of them.  Both depend on the span and the number of rays alone.
class SpanCut {
 public:
  /// A span has at most so many portions.
  static constexpr std::size_t kMostPortions = 4096;

  SpanCut(std::size_t rays, const SampleSpan& span);

  const std::vector<Chunk>& chunks() const { return chunks_; }
  std::size_t portions() const { return (chunks_.size() + each_ - 1) / each_; }
  std::size_t portion_of_chunk(std::size_t chunk) const { return chunk / each_; }
  /// Of a sample by its ray and its number.
  std::size_t portion_of(std::size_t ray, std::uint64_t number) const;
  /// First and end of the chunks of a portion.
  std::pair<std::size_t, std::size_t> chunks_of(std::size_t portion) const;
  /// log2 of the samples of a whole chunk of one ray.
  int level() const { return level_; }
  /// Whether the samples of one ray are in several chunks.
  bool splits_rays() const { return splits_; }

 private:
  std::vector<Chunk> chunks_;
  std::uint64_t first_ = 0;
  std::size_t each_ = 1;      ///< chunks of a portion
  std::size_t together_ = 1;  ///< rays of a chunk
  std::size_t of_ray_ = 1;    ///< chunks of a ray
  int level_ = 0;
  bool splits_ = false;
};

}  // namespace nullmark
