#include "estimators/walk/rng.h"

#include <Random123/philox.h>

#include <array>

#include "harness/sampling/reference_loops.h"
#include "harness/testing/bench.h"
#include "media/base/elementary.h"

#undef philox4x32  // Random123 has a macro of that name

namespace nullmark {
namespace {

constexpr std::size_t kBlock = 256;

/// A block of items an iteration; `block(first)` gives something that depends on all of them.
template <class Block>
void run(benchmark::State& state, const char* item, Block block) {
  std::uint64_t first = 0;
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(block(first));
    first += kBlock;
  }
  count_items(state, item, first);
}

template <class Draw>
Real sum(const Draw& draw) {
  Real total = 0;
  for (std::size_t i = 0; i < kBlock; ++i) total += draw();
  return total;
}

std::uint32_t philox_block(std::uint64_t first) {
  std::uint32_t mixed = 0;
  for (std::uint64_t i = first; i < first + kBlock; ++i) {
    const auto words = philox4x32({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32), 3, 0}, {1, 2});
    mixed ^= words[0] ^ words[1] ^ words[2] ^ words[3];
  }
  return mixed;
}

std::uint32_t random123_block(std::uint64_t first) {
  std::uint32_t mixed = 0;
  for (std::uint64_t i = first; i < first + kBlock; ++i) {
    const auto words = r123::Philox4x32()({{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32), 3, 0}}, {{1, 2}});
    mixed ^= words[0] ^ words[1] ^ words[2] ^ words[3];
  }
  return mixed;
}

/// The first uniform of each stream: what a sample costs before it does anything.
Real new_streams(std::uint64_t first) {
  Real total = 0;
  for (std::uint64_t i = first; i < first + kBlock; ++i) total += Rng(SampleAddress{1, 3, i}).uniform();
  return total;
}

/// As block kernels draw: the next exponentials of all streams by one call.
class DrawnAhead {
 public:
  DrawnAhead() {
    for (std::size_t i = 0; i < kBlock; ++i) rng_[i] = Rng(SampleAddress{1, 3, i});
  }
  Real operator()(std::uint64_t) {
    for (std::size_t i = 0; i < kBlock; ++i) ahead_[i] = rng_[i].peek();
    negative_logarithms(ahead_.data(), kBlock, ahead_.data());
    Real total = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
      rng_[i].make_ready(ahead_[i]);
      total += rng_[i].exponential();
    }
    return total;
  }

 private:
  std::array<Rng, kBlock> rng_;
  std::array<Real, kBlock> ahead_;
};

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  const auto add = [](const char* name, auto function) { benchmark::RegisterBenchmark(name, function); };
  add("uniform random number/0 xoshiro256+, hand-written", [](benchmark::State& state) {
    PlainRng rng(1);
    run(state, "number", [&](std::uint64_t) { return sum([&] { return rng.uniform(); }); });
  });
  add("uniform random number/Rng::uniform", [](benchmark::State& state) {
    Rng rng(SampleAddress{1, 3, 0});
    run(state, "number", [&](std::uint64_t) { return sum([&] { return rng.uniform(); }); });
  });
  add("stream of an address/0 Random123's Philox4x32-10, one block",
      [](benchmark::State& state) { run(state, "stream", random123_block); });
  add("stream of an address/philox4x32, one block", [](benchmark::State& state) { run(state, "stream", philox_block); });
  add("stream of an address/Rng and its first uniform", [](benchmark::State& state) { run(state, "stream", new_streams); });
  add("exponential random number/0 xoshiro256+, std::log, hand-written", [](benchmark::State& state) {
    PlainRng rng(1);
    run(state, "number", [&](std::uint64_t) { return sum([&] { return -std::log(1 - rng.uniform()); }); });
  });
  add("exponential random number/Rng::exponential", [](benchmark::State& state) {
    Rng rng(SampleAddress{1, 3, 0});
    run(state, "number", [&](std::uint64_t) { return sum([&] { return rng.exponential(); }); });
  });
  add("exponential random number/256 streams drawn ahead", [](benchmark::State& state) { run(state, "number", DrawnAhead()); });
});

}  // namespace
}  // namespace nullmark
