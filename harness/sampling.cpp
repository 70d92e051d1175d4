#include "harness/sampling.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "harness/eight.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

/// Samples that a kernel is asked for at once.
constexpr int kBatchLevel = 14;
constexpr std::uint64_t kBatch = std::uint64_t{1} << kBatchLevel;

/// Chunks of a cell, at most about: their results are kept until they are merged.
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 18;

/// log2 of the samples of one ray that make a chunk.  A power of two, so that a chunk is a complete group of the convergence
/// data; decided by the plan alone, never by the threads.
int chunk_level(std::size_t rays, std::uint64_t samples) {
  int level = kBatchLevel;
  while (level < 62 && (samples >> level) * rays > kMostChunks && (samples >> level) > 0) ++level;
  return level;
}

/// Rays [first_ray, end_ray) with all their samples, or one ray with samples [first, first + count).
struct Chunk {
  std::size_t first_ray, end_ray;
  std::uint64_t first, count;
};

struct ChunkResult {
  std::vector<Moments> moments;
  std::vector<Real> group_sums;  ///< per channel, of a split ray's chunk
  std::vector<GroupErrors> groups;
  std::vector<BlockErrors> blocks;
  std::vector<std::uint64_t> lookups, null_collisions;
  std::vector<Real> lookups_squared;
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  Real largest = 0;
  std::map<std::size_t, Evidence> evidence;  ///< by test; a chunk touches few of them
  std::map<std::size_t, Evidence> variances;
  Clock::duration judging{}, statistics{}, working{};
};

/// Errors on their way to the tests of a gate: summed in runs of 2, 4, ... as the bets ask for, gathered over rays, and bet on by
/// the thousand.
class Evidences {
 public:
  /// Kept from chunk to chunk: fresh pages cost more than what is written to them.
  struct Memory {
    std::vector<std::vector<std::vector<Real>>> pending;  ///< by test and length of its sums
    std::vector<std::vector<Real>> sums;                  ///< by length

    static Memory& of_this_thread() {
      static thread_local Memory memory;
      return memory;
    }
    static Memory& of_variances() {
      static thread_local Memory memory;
      return memory;
    }
  };

  Evidences(const CellGate* gate, std::span<const MeanTest> tests, std::size_t channels, Memory& memory,
            std::map<std::size_t, Evidence>& out)
      : gate_(gate),
        tests_(tests),
        out_(out),
        pooled_(channels),
        grouped_(channels),
        pending_(memory.pending),
        sums_(memory.sums) {
    pending_.resize(std::max(pending_.size(), tests_.size()));
    for (std::vector<std::vector<Real>>& lengths : pending_)
      for (std::vector<Real>& waiting : lengths) waiting.clear();  // of a run that was stopped
    for (std::size_t i = 0; i < tests_.size(); ++i) {
      const MeanTest& test = tests_[i];
      const std::size_t lengths = test.sum_lengths.size();
      pending_[i].resize(std::max(pending_[i].size(), lengths));
      sums_.resize(std::max(sums_.size(), lengths));
      if (test.channel == MeanTest::kLookups) {
        lookups_ = i;
      } else if (test.group == MeanTest::kAllRays) {
        pooled_[static_cast<std::size_t>(test.channel)] = i;
      } else {
        auto& list = grouped_[static_cast<std::size_t>(test.channel)];
        list.resize(std::max(list.size(), static_cast<std::size_t>(test.group) + 1));
        list[static_cast<std::size_t>(test.group)] = i;
      }
    }
  }

  void add_errors(std::size_t ray, std::size_t channel, std::span<const Real> errors) {
    if (!pooled_[channel]) return;
    const auto largest = [&] {
      Real most = 0;
      for (const Real error : errors) most = std::max(most, std::abs(error));
      return most;
    };
    add_to(*pooled_[channel], errors, 0, largest);
    if (!grouped_[channel].empty())
      add_to(*grouped_[channel][static_cast<std::size_t>(gate_->group_of[ray])], errors, 0, largest);
  }

  void add_lookups(std::size_t ray, std::span<const std::uint32_t> lookups) {
    if (!lookups_ || lookups.empty()) return;
    const Real expected = gate_->lookups[ray];
    add_to(*lookups_, lookups, expected, [&] {
      const auto [least, most] = std::minmax_element(lookups.begin(), lookups.end());
      return std::max(expected - *least, *most - expected);
    });
  }

  void finish() {
    for (std::size_t test = 0; test < tests_.size(); ++test)
      for (std::size_t length = 0; length < tests_[test].sum_lengths.size(); ++length) flush(test, length);
  }

 private:
  static constexpr std::size_t kTogether = 8192, kEnough = 2048;

  /// Every sum is one of those before it: the shortest of the numbers, less what is expected of each.
  template <class Number, class Largest>
  void add_to(std::size_t test, std::span<const Number> numbers, Real expected, Largest largest_error) {
    const std::vector<int>& lengths = tests_[test].sum_lengths;
    std::span<const Real> sums = sum(numbers, lengths[0], expected * lengths[0], sums_[0]);
    feed(test, 0, sums);
    for (std::size_t i = 1; i < lengths.size(); ++i) {
      sums = sum(sums, lengths[i] / lengths[i - 1], 0, sums_[i]);
      feed(test, i, sums);
    }
    Evidence& evidence = out_[test];
    evidence.errors += numbers.size();
    for (const Real x : sums) evidence.total_error += x;
    if (tests_[test].deterministic) evidence.largest_error = std::max(evidence.largest_error, largest_error());
  }

  /// Sums of so many numbers each, less what is expected of one.  Which numbers share a sum is free; a stride lets a register of
  /// sums advance together.
  template <class Number>
  static std::span<const Real> sum(std::span<const Number> numbers, int together, Real expected, std::vector<Real>& sums) {
    if constexpr (std::is_same_v<Number, const Real> || std::is_same_v<Number, Real>)
      if (together == 1 && expected == 0) return numbers;
    const std::size_t count = numbers.size() / static_cast<std::size_t>(together);
    sums.resize(count);
    constexpr std::size_t kSideBySide = 64;
    std::array<Real, kSideBySide> run;
    for (std::size_t j = 0; j < count; j += kSideBySide) {
      const std::size_t width = std::min(kSideBySide, count - j);
      const auto add = [&](std::size_t n) {
        const Number* from = &numbers[j];
        for (std::size_t i = 0; i < n; ++i) run[i] = static_cast<Real>(from[i]);
        for (int k = 1; k < together; ++k) {
          from += count;
          for (std::size_t i = 0; i < n; ++i) run[i] += static_cast<Real>(from[i]);
        }
        for (std::size_t i = 0; i < n; ++i) sums[j + i] = run[i] - expected;
      };
      // A width that the compiler knows stays in registers.
      width == kSideBySide ? add(kSideBySide) : add(width);
    }
    return sums;
  }

  void feed(std::size_t test, std::size_t length, std::span<const Real> sums) {
    if (tests_[test].bets.empty()) return;
    std::vector<Real>& waiting = pending_[test][length];
    if (waiting.empty() && sums.size() >= kEnough) {
      out_[test].bet(tests_[test], tests_[test].sum_lengths[length], sums);
      return;
    }
    waiting.insert(waiting.end(), sums.begin(), sums.end());
    if (waiting.size() >= kTogether) flush(test, length);
  }

  void flush(std::size_t test, std::size_t length) {
    std::vector<Real>& waiting = pending_[test][length];
    if (waiting.empty()) return;
    out_[test].bet(tests_[test], tests_[test].sum_lengths[length], waiting);
    waiting.clear();
  }

  const CellGate* gate_;
  std::span<const MeanTest> tests_;
  std::map<std::size_t, Evidence>& out_;
  std::vector<std::optional<std::size_t>> pooled_;                // test by channel
  std::vector<std::vector<std::optional<std::size_t>>> grouped_;  // by channel and group
  std::optional<std::size_t> lookups_;
  std::vector<std::vector<std::vector<Real>>>& pending_;
  std::vector<std::vector<Real>>& sums_;
};

std::vector<Chunk> cut(std::size_t rays, std::uint64_t samples, std::uint64_t chunk) {
  std::vector<Chunk> chunks;
  if (samples > chunk) {
    for (std::size_t r = 0; r < rays; ++r)
      for (std::uint64_t first = 0; first < samples; first += chunk)
        chunks.push_back({r, r + 1, first, std::min(chunk, samples - first)});
  } else {
    // Small cells are cut as well, so that all threads have something to do.
    constexpr std::size_t kLeastChunks = 8;
    const std::size_t together = std::max<std::size_t>(1, std::min<std::size_t>(kBatch / samples, rays / kLeastChunks));
    for (std::size_t r = 0; r < rays; r += together) chunks.push_back({r, std::min(rays, r + together), 0, samples});
  }
  return chunks;
}

/// The threads' private memory.
struct Scratch {
  std::unique_ptr<Workspace> workspace;
  RayContext context;
  SampleBlock block;
  std::vector<Real> errors, finite;
};

/// Rounding allowed to samples at the ends of their declared range.
constexpr Real kRangeSlack = 1e-9, kSingleRangeSlack = 1e-5;

/// errors = values - reference; whether all values lie in [low, high], which none does that is not finite; then `largest` has
/// grown to the largest of their magnitudes.
bool subtract(const Real* values, Real reference, Real low, Real high, std::span<Real> errors, Real& largest) {
  Eight value{}, most{}, least{};
  auto inside = most == least;  // in every lane
  std::size_t i = 0;
  for (; i + kEight <= errors.size(); i += kEight) {
    load(values + i, value);
    inside &= (value >= low) & (value <= high);
    most = value > most ? value : most;
    least = value < least ? value : least;
    store(value - reference, &errors[i]);
  }
  bool all = true;
  Real farthest = largest;
  for (std::size_t lane = 0; lane < kEight; ++lane) {
    all &= inside[lane] != 0;
    farthest = std::max({farthest, most[lane], -least[lane]});
  }
  for (; i < errors.size(); ++i) {
    all &= values[i] >= low && values[i] <= high;
    errors[i] = values[i] - reference;
    farthest = std::max(farthest, std::abs(values[i]));
  }
  if (all) largest = farthest;
  return all;
}

Real sum_of_squares(std::span<const std::uint32_t> counts) {
  using Counts [[gnu::vector_size(kEight * sizeof(std::uint32_t))]] = std::uint32_t;
  Eight sum{};
  Counts each;
  std::size_t i = 0;
  for (; i + kEight <= counts.size(); i += kEight) {
    std::memcpy(&each, &counts[i], sizeof each);
    const Eight count = __builtin_convertvector(each, Eight);
    sum += count * count;
  }
  Real result = total(sum);
  for (; i < counts.size(); ++i) result += static_cast<Real>(counts[i]) * counts[i];
  return result;
}

}  // namespace

Real measured(Real value, const Measurement& measurement) {
  if (measurement.clamp) value = std::min<Real>(1, std::max<Real>(0, value));
  if (measurement.quantise_bits > 0) {
    const Real steps = std::ldexp(1., measurement.quantise_bits) - 1;
    value = std::round(steps * value) / steps;
  }
  return value;
}

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const CellGate* gate, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size();
  const std::size_t outputs = targets.outputs;
  const std::uint64_t key = stream_key(cell, *scene.medium);
  const int level = chunk_level(rays, span.per_ray);
  const std::uint64_t whole_chunk = std::uint64_t{1} << level;
  const std::vector<Chunk> chunks = cut(rays, span.per_ray, whole_chunk);

  Sampled result;
  result.moments.resize(rays * outputs);
  result.lookups.resize(rays);
  result.null_collisions.resize(rays);
  result.blocks.resize(outputs);
  result.lookups_squared.resize(rays);
  result.groups.resize(outputs);

  if (gate) result.evidence.resize(gate->tests.size());
  if (gate) result.variances.resize(gate->variances.size());
  if (span.keep) result.kept = KeptSamples(rays, span.first, span.per_ray, outputs);

  std::vector<ChunkResult> results(chunks.size());
  std::atomic<bool> stopped = false;
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch fresh;
    fresh.workspace = kernel.workspace();
    fresh.workspace->stop = [&] {
      if (stop()) stopped = true;
      return stopped.load();
    };
    return fresh;
  });
  // Fills `errors` of an output, 0 for samples that are not finite, and tells those that count.
  constexpr Real kLargest = std::numeric_limits<Real>::max();
  const Real slack = cell.precision == Precision::float64 ? kRangeSlack : kSingleRangeSlack;
  const Real low = gate ? std::max(gate->low - slack, -kLargest) : -kLargest;
  const Real high = gate ? std::min(gate->high + slack, kLargest) : kLargest;
  const bool as_drawn = cell.measurement == Measurement{};
  const auto take_errors = [&](Scratch& mine, std::size_t o, Real target, std::span<Real> errors,
                               ChunkResult& out) -> std::span<const Real> {
    const std::vector<Real>& values = mine.block.values;
    const Real reference = measured(target, cell.measurement);
    if (as_drawn) {
      const Real* drawn = values.data();
      if (outputs > 1) {
        mine.finite.resize(errors.size());
        for (std::size_t i = 0; i < errors.size(); ++i) mine.finite[i] = values[i * outputs + o];
        drawn = mine.finite.data();
      }
      if (subtract(drawn, reference, low, high, errors, out.largest)) return errors;
    }
    mine.finite.clear();
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const Real value = values[i * outputs + o];
      errors[i] = 0;
      if (!std::isfinite(value)) {
        ++out.nonfinite;
        continue;
      }
      out.out_of_range += !(value >= low && value <= high);
      out.largest = std::max(out.largest, std::abs(value));
      errors[i] = measured(value, cell.measurement) - reference;
      mine.finite.push_back(errors[i]);
    }
    return mine.finite;
  };
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t at) {
    if (stopped || stop()) {
      stopped = true;
      return;
    }
    const Chunk& chunk = chunks[at];
    ChunkResult& out = results[at];
    Scratch& mine = scratch.local();
    out.moments.resize((chunk.end_ray - chunk.first_ray) * outputs);
    out.lookups.resize(chunk.end_ray - chunk.first_ray);
    out.lookups_squared.resize(chunk.end_ray - chunk.first_ray);
    out.null_collisions.resize(chunk.end_ray - chunk.first_ray);
    out.groups.resize(outputs);
    out.blocks.resize(outputs);
    out.group_sums.assign(outputs, 0);
    const auto begun = Clock::now();
    const bool varies = gate && !gate->variances.empty() && !span.only_evidence;
    const std::span<const MeanTest> tests = gate ? gate->tests : std::span<const MeanTest>();
    Evidences evidences(gate, tests, outputs, Evidences::Memory::of_this_thread(), out.evidence);
    Evidences variances(gate, varies ? gate->variances : std::span<const MeanTest>(), outputs, Evidences::Memory::of_variances(),
                        out.variances);
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      scene.context(ray, kernel, mine.context);
      kernel.begin_ray(*mine.workspace, *scene.medium->medium, scene.medium->extrema, mine.context);
      const std::uint64_t lookups_before = out.counters.lookups, null_collisions_before = out.counters.null_collisions;
      const std::size_t local = ray - chunk.first_ray;
      for (std::uint64_t drawn = 0; drawn < chunk.count && !stopped; drawn += kBatch) {
        if (drawn > 0 && stop()) stopped = true;
        const std::uint64_t batch = std::min(kBatch, chunk.count - drawn);
        kernel.sample(*mine.workspace, *scene.medium->medium, mine.context, key, span.first + chunk.first + drawn, batch,
                      cell.quantity, mine.block, out.counters);
        const auto drawn_at = Clock::now();
        if (span.keep) result.kept.keep(ray, span.first + chunk.first + drawn, batch, mine.block.values);
        mine.errors.resize(batch * outputs);
        for (std::size_t o = 0; o < outputs; ++o) {
          const Real target = targets.mean[ray * outputs + o];
          const std::span<Real> errors(&mine.errors[o * batch], batch);
          const std::span<const Real> counted = take_errors(mine, o, target, errors, out);
          if (span.only_evidence) continue;
          out.blocks[o].add(ray, counted, out.moments[local * outputs + o]);
          out.groups[o].add(counted);
        }
        if (!span.only_evidence) out.lookups_squared[local] += sum_of_squares(mine.block.lookups);
        const auto counted_at = Clock::now();
        for (std::size_t o = 0; o < outputs && gate; ++o) {
          const std::span<Real> errors(&mine.errors[o * batch], batch);
          if (const Real shift = gate->shift[ray * outputs + o]; shift != 0)
            for (Real& error : errors) error -= shift;
          evidences.add_errors(ray, o, errors);
          if (!varies) continue;
          for (Real& error : errors) error = error * error - gate->stated_variance[ray * outputs + o];
          variances.add_errors(ray, o, errors);
        }
        evidences.add_lookups(ray, mine.block.lookups);
        const auto judged_at = Clock::now();
        out.statistics += judged_at - drawn_at;
        out.judging += judged_at - counted_at;
      }
      out.lookups[local] = out.counters.lookups - lookups_before;
      out.null_collisions[local] = out.counters.null_collisions - null_collisions_before;
      for (std::size_t o = 0; o < outputs; ++o) {
        out.group_sums[o] = out.moments[local * outputs + o].s1;
        out.groups[o].finish_ray();
      }
    }
    const auto drawn_at = Clock::now();
    evidences.finish();
    variances.finish();
    const auto judged_at = Clock::now();
    out.statistics += judged_at - drawn_at;
    out.judging += judged_at - drawn_at;
    out.working += judged_at - begun;
    progress(static_cast<double>(++done) / static_cast<double>(chunks.size()));
  });
  if (stopped) return std::nullopt;

  std::vector<GroupErrors> across(outputs);  // groups larger than a chunk, within one ray
  for (std::size_t at = 0; at < chunks.size(); ++at) {
    const Chunk& chunk = chunks[at];
    const ChunkResult& part = results[at];
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      for (std::size_t o = 0; o < outputs; ++o)
        result.moments[ray * outputs + o] += part.moments[(ray - chunk.first_ray) * outputs + o];
      result.lookups[ray] += part.lookups[ray - chunk.first_ray];
      result.null_collisions[ray] += part.null_collisions[ray - chunk.first_ray];
      result.lookups_squared[ray] += part.lookups_squared[ray - chunk.first_ray];
    }
    for (std::size_t o = 0; o < outputs; ++o) {
      result.groups[o] += part.groups[o];
      result.blocks[o] += part.blocks[o];
      if (span.per_ray <= whole_chunk || span.only_evidence) continue;
      if (chunk.first == 0) across[o].finish_ray();
      if (chunk.count == whole_chunk) across[o].carry(static_cast<std::size_t>(level), part.group_sums[o]);
    }
    result.counters += part.counters;
    result.nonfinite += part.nonfinite;
    result.out_of_range += part.out_of_range;
    result.largest = std::max(result.largest, part.largest);
    result.statistics_seconds += std::chrono::duration<double>(part.statistics).count();
    result.judging_seconds += std::chrono::duration<double>(part.judging).count();
    result.working_seconds += std::chrono::duration<double>(part.working).count();
    for (const auto& [test, evidence] : part.evidence) result.evidence[test] += evidence;
    for (const auto& [test, evidence] : part.variances) result.variances[test] += evidence;
  }
  if (span.per_ray > whole_chunk && !span.only_evidence) {
    // A chunk's own groups already hold the level at which the chunks begin.
    for (std::size_t o = 0; o < outputs; ++o) result.groups[o].append_above(static_cast<std::size_t>(level), across[o]);
  }
  return result;
}

RayProfile make_profile(const Medium& medium, const Ray& local, const SegmentBuffer& buffer) {
  std::vector<Real> knots, ends, rates;
  sorted_knots(medium, local, knots);
  for (const Segment& segment : buffer.segments) {
    ends.push_back(segment.end);
    rates.push_back(segment.majorant);
  }
  return RayProfile(
      [&medium, local](const Real* t, std::size_t n, Real* out) {
        std::vector<Real> x(n), y(n), z(n);
        for (std::size_t i = 0; i < n; ++i) {
          const Vec3 p = local.at(t[i]);
          x[i] = p.x(), y[i] = p.y(), z[i] = p.z();
        }
        medium.extinction({x.data(), y.data(), z.data(), n}, out);
      },
      medium.channels(), knots, ends, rates);
}

namespace {

/// Theory of every query along every ray.
class RayTheories {
 public:
  RayTheories(const Scene& scene, const std::vector<TheoryQuery>& queries);

  const Theory& at(std::size_t query, std::size_t ray, std::size_t channel) const {
    return all_[(ray * queries_ + query) * channels_ + channel];
  }
  std::size_t rays() const { return majorant_depth_.size(); }
  std::size_t channels() const { return channels_; }
  Real mean_majorant_depth() const {
    return std::accumulate(majorant_depth_.begin(), majorant_depth_.end(), Real{0}) / static_cast<Real>(rays());
  }

 private:
  std::size_t queries_, channels_;
  std::vector<Theory> all_;
  std::vector<Real> majorant_depth_;
};

RayTheories::RayTheories(const Scene& scene, const std::vector<TheoryQuery>& queries)
    : queries_(queries.size()),
      channels_(static_cast<std::size_t>(scene.reference->channels)),
      all_(scene.rays->local.size() * queries_ * channels_),
      majorant_depth_(scene.rays->local.size()) {
  struct Memory {
    std::vector<std::unique_ptr<Workspace>> workspaces;
    RayContext context;
  };
  tbb::enumerable_thread_specific<Memory> memory([&] {
    Memory mine;
    for (const TheoryQuery& query : queries) mine.workspaces.push_back(query.kernel->workspace());
    return mine;
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays(), 8), [&](const auto& range) {
    Memory& mine = memory.local();
    for (std::size_t ray = range.begin(); ray < range.end(); ++ray) {
      const Medium& medium = *scene.medium->medium;
      std::optional<RayProfile> profile;
      for (std::size_t k = 0; k < queries.size(); ++k) {
        const Kernel& kernel = *queries[k].kernel;
        scene.context(ray, kernel, mine.context);
        if (!profile) {
          profile.emplace(make_profile(medium, scene.rays->local[ray], mine.context.segments));
          for (const Segment& segment : mine.context.segments.segments)
            majorant_depth_[ray] += segment.majorant * (segment.end - segment.begin);
        }
        kernel.begin_ray(*mine.workspaces[k], medium, scene.medium->extrema, mine.context);
        const std::vector<Theory> theory = kernel.theory(*mine.workspaces[k], *profile, queries[k].quantity);
        for (std::size_t c = 0; c < channels_; ++c) all_[(ray * queries_ + k) * channels_ + c] = theory[c];
      }
    }
  });
}

bool finite(const std::optional<Real>& x) { return x && std::isfinite(*x); }

void state_lookups(CellTheory& cell, const RayTheories& theories, std::size_t k) {
  const std::size_t rays = theories.rays();
  cell.ray_lookups.resize(rays);
  cell.ray_lookups_variance.resize(rays);
  Real lookups = 0;
  bool all_lookups = true, all_spreads = true, heavy = false;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    const Theory& theory = theories.at(k, ray, 0);
    all_lookups = all_lookups && finite(theory.lookups);
    heavy = heavy || (theory.lookups_variance && *theory.lookups_variance == kInfinity);
    all_spreads = all_spreads && finite(theory.lookups_variance);
    lookups += cell.ray_lookups[ray] = theory.lookups.value_or(0);
    cell.ray_lookups_variance[ray] = theory.lookups_variance.value_or(0);
  }
  if (all_lookups) cell.lookups = lookups / static_cast<Real>(rays);
  cell.majorant_depth = theories.mean_majorant_depth();
  // Of infinite variance an expectation is told, not tested: no number of samples decides it.
  if (!all_lookups || heavy) cell.ray_lookups.clear();
  if (!all_spreads) cell.ray_lookups_variance.clear();
}

/// What the theories along the rays say of a cell, the `k`-th query, as a whole.
CellTheory theory_of_cell(const RayTheories& theories, std::size_t k, const TheoryQuery& query, const Scene& scene) {
  const std::size_t rays = theories.rays(), channels = theories.channels();
  const auto n = static_cast<Real>(rays);
  CellTheory cell;
  const Targets& targets = *query.targets;
  const std::size_t outputs = targets.outputs;
  const bool one_per_channel = targets.names.empty();
  // Scores that are 0 or 1 have the variance of a coin; a free path's last output is its weight.
  bool coins = !one_per_channel && query.range == SampleRange::binary && scene.bounding;
  if (query.quantity == Quantity::free_path) {
    bool always_one = true;
    for (std::size_t i = 0; i < rays * channels && always_one; ++i) {
      const Theory& theory = theories.at(k, i / channels, i % channels);
      always_one = theory.variance && *theory.variance == 0;
    }
    coins = cell.unit_weights = coins || always_one;
  }
  bool all_variances = true;
  cell.ray_shift.assign(rays * outputs, 0);
  cell.ray_variance.resize(rays * outputs);
  for (std::size_t o = 0; o < outputs; ++o) {
    const bool is_weight = query.quantity == Quantity::free_path && o + channels >= outputs;
    Real variance = 0, bias = 0, squared = 0;
    bool known = true;
    for (std::size_t ray = 0; ray < rays; ++ray) {
      const Real expected = targets.mean[ray * outputs + o];
      Theory theory;
      if (one_per_channel || is_weight) theory = theories.at(k, ray, o % channels);
      if (coins) theory.variance = expected * (1 - expected);
      const Real gap = theory.mean ? *theory.mean - expected : 0;
      cell.ray_shift[ray * outputs + o] = gap;
      cell.ray_variance[ray * outputs + o] = theory.variance.value_or(0);
      known = known && finite(theory.variance);
      cell.infinite_variance = cell.infinite_variance || (theory.variance && *theory.variance == kInfinity);
      variance += theory.variance.value_or(0);
      bias += gap;
      squared += gap * gap;
    }
    all_variances = all_variances && known;
    const auto where_known = [&](Real x) { return known ? std::optional(x / n) : std::nullopt; };
    cell.variance.push_back(where_known(variance));
    cell.bias.push_back(where_known(bias));
    cell.squared_bias.push_back(where_known(squared));
  }
  if (!all_variances) cell.ray_variance.clear();
  state_lookups(cell, theories, k);
  return cell;
}

}  // namespace

std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<TheoryQuery>& queries) {
  const RayTheories theories(scene, queries);
  std::vector<CellTheory> result;
  for (std::size_t k = 0; k < queries.size(); ++k) result.push_back(theory_of_cell(theories, k, queries[k], scene));
  return result;
}

}  // namespace nullmark
