#include <fmt/format.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>

#include "harness/model/names.h"
#include "harness/sampling/reference_loops.h"
#include "harness/testing/bench_kernel.h"

namespace nullmark {
namespace {

// What lanes give over one walk at a time: ratio and delta tracking on rays of length 1 that look up the medium 5 or 30 times a
// sample, in double and in float, beside the plain loops, and beside the least that a step in registers can cost.  Inputs of
// hand-written loops are volatile, see estimators_bench.cpp.

const Ray kRay{{0, 0.5, 0.5}, {1, 0, 0}, 0, 1};

/// Bound at which a tracker looks up the medium so often: ratio tracking mub times along the ray, delta tracking until it is
/// absorbed, mub int_0^1 T(0, x) dx times.
Real bound_for(Real lookups, bool ratio, const Medium& medium) {
  if (ratio) return lookups;
  const auto transmittance = [&](Real x) { return std::exp(-(*medium.optical_depth({kRay.origin, kRay.direction, 0, x}))[0]); };
  return lookups / boost::math::quadrature::gauss_kronrod<Real, 61>::integrate(transmittance, 0., 1.);
}

/// Delta tracking as one would write it by hand, see plain_ratio_loop.
template <class Extinction>
Real plain_delta_loop(PlainRng& rng, Real majorant, const Extinction& extinction, std::uint64_t& lookups) {
  const Real inverse = 1 / majorant;
  Real t = 0;
  for (;;) {
    t -= std::log(1 - rng.uniform()) * inverse;
    if (t >= 1) return 1;
    ++lookups;
    if (rng.uniform() * majorant < extinction(t)) return 0;
  }
}

void plain(benchmark::State& state, bool ratio, Real majorant, const auto& extinction) {
  if (ratio)
    run_plain_bench(state,
                    [&](PlainRng& rng, std::uint64_t& lookups) { return plain_ratio_loop(rng, majorant, extinction, lookups); });
  else
    run_plain_bench(state,
                    [&](PlainRng& rng, std::uint64_t& lookups) { return plain_delta_loop(rng, majorant, extinction, lookups); });
}

template <class T, bool with_exponential, bool with_number = false>
void lane_floor(benchmark::State& state) {
  constexpr std::uint64_t kSteps = 4096;
  auto streams = LaneRng<T, kNativeLanes<T>>::seeded({1, 2, 3});
  volatile Real rate = 1e-3;
  std::uint64_t steps = 0;
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(lane_floor_loop<T, with_exponential, with_number>(streams, rate, kSteps));
    steps += kSteps;
  }
  count_items(state, "sample", steps);
  count_lookups(state, steps);
}

void add(const std::string& profile, bool ratio, Real lookups, const std::shared_ptr<const Medium>& medium,
         const auto& extinction) {
  const std::string name = ratio ? "ratio" : "delta";
  const std::string group = fmt::format("lanes, {} tracking, {}, {} lookups/", name, profile, lookups);
  const Real bound = bound_for(lookups, ratio, *medium);
  const auto in_registry = [=](const std::string& what, auto run) { benchmark::RegisterBenchmark((group + what).c_str(), run); };
  in_registry("0 hand-written", [=](benchmark::State& state) { plain(state, ratio, bound, extinction); });
  for (const Precision precision : {Precision::float64, Precision::float32})
    in_registry(to_string(precision), [=](benchmark::State& state) {
      run_kernel_bench(state,
                       KernelBench({name, {}, {}, {}}, medium, {"prescribed", {{"value", bound}}, {}, {}}, kRay, precision));
    });
  in_registry("least step, double", lane_floor<double, false>);
  in_registry("least step, float", lane_floor<float, false>);
  in_registry("least step with exponential, double", lane_floor<double, true>);
  in_registry("least step with exponential, float", lane_floor<float, true>);
  if (!ratio) {
    in_registry("least step with exponential and two numbers, double", lane_floor<double, true, true>);
    in_registry("least step with exponential and two numbers, float", lane_floor<float, true, true>);
  }
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  // Inputs that the compiler must not know.
  static volatile Real extinction = 0.4, centre = 0.32, sigma = 0.05;
  for (const bool ratio : {true, false})
    for (const Real lookups : {5., 30.}) {
      add("constant", ratio, lookups, make_medium({"homogeneous", {{"extinction", 0.4}}, {}, {}})->build(),
          [mu = Real{extinction}](Real) { return mu; });
      add("Gaussian", ratio, lookups, make_medium({"gaussian_bump", {{"amplitude", 4.}}, {}, {}})->build(),
          [c = Real{centre}, scale = 1 / Real{sigma}](Real t) {
            const Real s = (t - c) * scale;
            return 4 * std::exp(-0.5 * s * s);
          });
    }
});

}  // namespace
}  // namespace nullmark
