#include "harness/run/cell_draws.h"

#include <fmt/format.h>

#include <utility>

#include "harness/io/json_input.h"
#include "harness/io/packing.h"
#include "harness/model/hash.h"
#include "harness/run/archive.h"

namespace nullmark {

// What is stored of each structure.
template <class A>
void fields(A& a, Moments& m) {
  a(m.s1, m.s2, m.s3, m.s4, m.count);
}
template <class A>
void fields(A& a, BlockErrors& b) {
  a(b.squares, b.count);
}
template <class A>
void fields(A& a, GroupErrors::Level& level) {
  a(level.sum_of_squares, level.groups);
}
template <class A>
void fields(A& a, GroupErrors& groups) {
  std::vector<GroupErrors::Level> levels = groups.levels();
  a(levels);
  groups = GroupErrors(std::move(levels));
}
template <class A>
void fields(A& a, Evidence& e) {
  a(e.logs, e.errors, e.total_error, e.largest_error);
}
template <class A>
void fields(A& a, Counters& c) {
  a(c.samples, c.lookups, c.null_collisions, c.draws, c.violations, c.overruns, c.largest_violation);
}
template <class A>
void fields(A& a, Portion& p) {
  a(p.first_ray, p.end_ray, p.moments, p.lookups, p.null_collisions, p.lookups_squared, p.chunk_sums, p.groups, p.blocks,
    p.counters, p.nonfinite, p.out_of_range, p.largest, p.evidence, p.variances, p.kept);
}
template <class A>
void fields(A& a, CellTheory& t) {
  a(t.variance, t.squared_bias, t.bias, t.lookups, t.most_lookups, t.majorant_depth, t.unit_weights, t.ray_variance, t.ray_shift,
    t.infinite_variance, t.ray_lookups, t.ray_lookups_variance, t.work);
}
template <class A>
void fields(A& a, Pilot& p) {
  a(p.variance, p.lookups_variance, p.samples, p.lookups, p.variance_of_variance);
}
template <class A>
void fields(A& a, LawRecord& law) {
  a(law.name, law.log_e, law.samples, law.outcome);
}
template <class A>
void fields(A& a, WalkLaws& laws) {
  a(laws.laws, laws.untested, laws.counted_walks);
}
template <class A>
void fields(A& a, CommonDraws& c) {
  a(c.theory, c.pilot.pilot, c.pilot.size, c.pilot_kept, c.laws, c.reliance);
}
template <class A>
void fields(A& a, DrawnSpan& span) {
  a(span.per_ray, span.portions);
}
template <class A>
void fields(A& a, CellDraws& draws) {
  a(draws.cell, draws.plan, draws.common, draws.spans);
}

namespace {

/// Changes with the meaning of the bytes.
constexpr std::uint64_t kVersion = 1;

/// Of one cell, unpacked.
constexpr std::size_t kMostBytes = std::size_t{1} << 32;

std::string bytes_of(auto& value) {
  ByteWriter writer;
  writer(value);
  return writer.take();
}

class Hash {
 public:
  template <class T>
  void operator()(const T& value) {
    hash_ = fnv1a({reinterpret_cast<const char*>(&value), sizeof value}, hash_);
  }
  void operator()(const std::vector<Real>& list) {
    for (const Real value : list) (*this)(value);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = fnv1a("tests");
};

}  // namespace

std::string draws_text(CellDraws draws) {
  ByteWriter writer;
  std::uint64_t version = kVersion;
  writer(version, draws);
  return packed(writer.take());
}

CellDraws read_draws(std::string_view text, const std::string& where) {
  CellDraws draws;
  const auto bytes = unpacked(text, kMostBytes);
  std::uint64_t version = 0;
  if (bytes) {
    ByteReader reader(*bytes);
    reader(version);
    if (version == kVersion) {
      reader(draws);
      if (reader.complete()) return draws;
    }
  }
  throw InputError(where + ": found drawn samples that are damaged; expected what the shard wrote: run the shard again");
}

void join(CellDraws& draws, CellDraws more, const std::string& where) {
  if (more.cell != draws.cell || more.plan != draws.plan)
    throw InputError(where + ": found samples drawn for other tests than those of the other parts; run the shard again");
  const auto twice = [&](auto& a, auto& b) {
    if (bytes_of(a) != bytes_of(b))
      throw InputError(where + ": found other samples than in another part; expected the same to the last bit");
  };
  if (!draws.common)
    draws.common = std::move(more.common);
  else if (more.common)
    twice(*draws.common, *more.common);
  for (auto& [first, span] : more.spans) {
    DrawnSpan& into = draws.spans.try_emplace(first, DrawnSpan{span.per_ray, {}}).first->second;
    if (into.per_ray != span.per_ray)
      throw InputError(where + ": found samples drawn in other steps than in another part; run the shard again");
    for (auto& [number, portion] : span.portions)
      if (const auto [at, fresh] = into.portions.try_emplace(number, std::move(portion)); !fresh) twice(at->second, portion);
  }
}

std::uint64_t hash_of(const TestPlan* plan) {
  if (!plan) return 0;
  Hash hash;
  for (const auto* tests : {&plan->tests, &plan->variances})
    for (const MeanTest& test : *tests) {
      hash(test.channel);
      hash(test.group);
      hash(test.planned);
      for (const auto& [role, bet] : test.bets) {
        hash(bet.side);
        hash(bet.limit);
        hash(bet.variance);
        hash(bet.rates);
        hash(bet.errors_per_sum);
      }
    }
  hash(plan->stated_variance);
  hash(plan->shift);
  hash(plan->lookups);
  return hash.value();
}

PortionShapes::PortionShapes(std::size_t rays, std::size_t outputs, const SampleSpan& span, const TestPlan* plan)
    : cut_(rays, span),
      outputs_(outputs),
      tests_(plan ? plan->tests.size() : 0),
      variances_(plan ? plan->variances.size() : 0),
      kept_(cut_.portions(), 0) {
  if (!span.keep) return;
  const KeptSamples kept(rays, span.first, span.per_ray, outputs);
  for (std::size_t i = 0; i < kept.count(); ++i) {
    const KeptSamples::Sample sample = kept.at(i);
    kept_[cut_.portion_of(sample.ray, sample.number)] += outputs;
  }
}

bool PortionShapes::fit(std::size_t number, const Portion& portion) const {
  if (number >= cut_.portions()) return false;
  const auto [first, end] = cut_.chunks_of(number);
  const Chunk &begins = cut_.chunks()[first], &ends = cut_.chunks()[end - 1];
  const std::size_t rays = ends.end_ray - begins.first_ray;
  const auto known = [](const std::map<std::size_t, Evidence>& evidence, std::size_t tests) {
    return evidence.empty() || evidence.rbegin()->first < tests;
  };
  return portion.first_ray == begins.first_ray && portion.end_ray == ends.end_ray && portion.moments.size() == rays * outputs_ &&
         portion.lookups.size() == rays && portion.null_collisions.size() == rays && portion.lookups_squared.size() == rays &&
         portion.chunk_sums.size() == (end - first) * outputs_ && portion.groups.size() == outputs_ &&
         portion.blocks.size() == outputs_ && portion.kept.size() == kept_[number] && known(portion.evidence, tests_) &&
         known(portion.variances, variances_);
}

bool fits(const CellTheory& theory, const PreparedCell& prepared) {
  const std::size_t rays = prepared.scene->rays->world.size(), outputs = prepared.targets.outputs;
  const auto either = [](std::size_t size, std::size_t full) { return size == 0 || size == full; };
  return either(theory.ray_variance.size(), rays * outputs) && either(theory.ray_shift.size(), rays * outputs) &&
         either(theory.ray_lookups.size(), rays) && either(theory.ray_lookups_variance.size(), rays);
}

}  // namespace nullmark
