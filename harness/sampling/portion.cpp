#include "harness/sampling/portion.h"

#include <algorithm>

namespace nullmark {
namespace {

/// Samples that a kernel is asked for at once.
constexpr int kBatchLevel = 14;

/// Chunks of a cell, at most about: their results are kept until they are merged.
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 18;

/// log2 of the samples of one ray that make a chunk.  A power of two, so that a chunk is a complete group of the convergence
/// data; decided by the plan alone, never by the threads.
int chunk_level(std::size_t rays, std::uint64_t samples) {
  int level = kBatchLevel;
  while (level < 62 && (samples >> level) * rays > kMostChunks && (samples >> level) > 0) ++level;
  return level;
}

template <class T>
void append_to(std::vector<T>& list, const std::vector<T>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace

SpanCut::SpanCut(std::size_t rays, const SampleSpan& span) : first_(span.first), level_(chunk_level(rays, span.per_ray)) {
  const std::uint64_t samples = span.per_ray, whole = std::uint64_t{1} << level_;
  splits_ = samples > whole;
  if (splits_) {
    of_ray_ = static_cast<std::size_t>((samples + whole - 1) / whole);
    for (std::size_t ray = 0; ray < rays; ++ray)
      for (std::uint64_t first = 0; first < samples; first += whole)
        chunks_.push_back({ray, ray + 1, first, std::min(whole, samples - first)});
  } else {
    // Small cells are cut as well, so that all threads have something to do.
    constexpr std::size_t kLeastChunks = 8;
    constexpr std::uint64_t kBatch = std::uint64_t{1} << kBatchLevel;
    together_ = std::max<std::size_t>(1, std::min<std::size_t>(kBatch / samples, rays / kLeastChunks));
    for (std::size_t ray = 0; ray < rays; ray += together_) chunks_.push_back({ray, std::min(rays, ray + together_), 0, samples});
  }
  each_ = std::max<std::size_t>(1, (chunks_.size() + kMostPortions - 1) / kMostPortions);
}

std::size_t SpanCut::portion_of(std::size_t ray, std::uint64_t number) const {
  if (!splits_) return ray / together_ / each_;
  return (ray * of_ray_ + static_cast<std::size_t>((number - first_) >> level_)) / each_;
}

std::pair<std::size_t, std::size_t> SpanCut::chunks_of(std::size_t portion) const {
  return {portion * each_, std::min(chunks_.size(), (portion + 1) * each_)};
}

void Portion::append(const Portion& next) {
  // The first chunk of the next may go on with the last ray of this one.
  const std::size_t outputs = groups.size(), shared = next.first_ray < end_ray ? 1 : 0;
  if (shared > 0) {
    for (std::size_t o = 0; o < outputs; ++o) moments[moments.size() - outputs + o] += next.moments[o];
    lookups.back() += next.lookups.front();
    null_collisions.back() += next.null_collisions.front();
    lookups_squared.back() += next.lookups_squared.front();
  }
  const auto from = static_cast<std::ptrdiff_t>(shared);
  moments.insert(moments.end(), next.moments.begin() + from * static_cast<std::ptrdiff_t>(outputs), next.moments.end());
  lookups.insert(lookups.end(), next.lookups.begin() + from, next.lookups.end());
  null_collisions.insert(null_collisions.end(), next.null_collisions.begin() + from, next.null_collisions.end());
  lookups_squared.insert(lookups_squared.end(), next.lookups_squared.begin() + from, next.lookups_squared.end());
  end_ray = next.end_ray;
  append_to(chunk_sums, next.chunk_sums);
  add_what_rays_share(next, *this);
}

}  // namespace nullmark
