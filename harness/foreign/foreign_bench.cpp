#include <fmt/format.h>

#include "harness/foreign/consent.h"
#include "harness/foreign/serve.h"
#include "harness/testing/bench_kernel.h"
#include "media/base/own_executable.h"

namespace nullmark {
namespace {

// What the seam to trackers from outside costs: a tracker that only looks up, beside the medium alone; and ratio tracking at 5
// lookups a sample, tails included, beside the built-in tracker, one walk at a time as the others.

std::shared_ptr<const Medium> constant() { return make_medium({"homogeneous", {{"extinction", 1.}}, {}, {}})->build(); }

void medium_alone(benchmark::State& state) {
  constexpr std::size_t kTogether = 512;
  const auto medium = constant();
  std::vector<Real> x(kTogether, 0.5), y(kTogether, 0.5), z(kTogether, 0.5), out(kTogether);
  std::uint64_t lookups = 0;
  for ([[maybe_unused]] auto _ : state) {
    medium->extinction({x.data(), y.data(), z.data(), kTogether}, out.data());
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
    lookups += kTogether;
  }
  count_items(state, "point", lookups);
  count_lookups(state, lookups);
}

Component library(const char* file) { return {"library", {{"file", std::string(file)}}, {}, {}}; }

Component process(const char* file, const char* name, bool shared_memory) {
  return {"process",
          {{"command", std::vector<std::string>{own_executable(), kServeLibrary, file, name}}, {"shared_memory", shared_memory}},
          {},
          {}};
}

void add(const std::string& name, const Component& tracker, Real lookups, bool lanes = true) {
  benchmark::RegisterBenchmark(("foreign/" + name).c_str(), [=](benchmark::State& state) {
    run_kernel_bench(state, KernelBench(tracker, constant(), {"prescribed", {{"value", lookups}}, {}, {}},
                                        {{0, 0.5, 0.5}, {1, 0, 0}, 0, 1}, Precision::float64, lanes));
  });
}

const BenchmarkGroup kGroup([] {
  allow_foreign_code();
  benchmark::RegisterBenchmark("foreign/lookups alone, 0 medium", medium_alone);
  add("lookups alone, library", library(NULLMARK_TOUCH_LIBRARY), 5);
  add("lookups alone, process", process(NULLMARK_TOUCH_LIBRARY, "touch", false), 5);
  add("lookups alone, process, shared memory", process(NULLMARK_TOUCH_LIBRARY, "touch", true), 5);
  add("ratio at 5 lookups, 0 built in", {"ratio", {}, {}, {}}, 5, false);
  add("ratio at 5 lookups, library", library(NULLMARK_EXAMPLE_LIBRARY), 5);
  add("ratio at 5 lookups, process", process(NULLMARK_EXAMPLE_LIBRARY, "ratio", false), 5);
  add("ratio at 5 lookups, process, shared memory", process(NULLMARK_EXAMPLE_LIBRARY, "ratio", true), 5);
});

}  // namespace
}  // namespace nullmark
