// Kernels allocate nothing once their memory has grown: every registered estimator, medium and majorant.  An executable of its
// own, since it replaces the global operator new.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "estimators/ratio.h"
#include "harness/kernel/path_kernel.h"
#include "harness/registry/register_estimator.h"
#include "harness/sampling/build_transport.h"
#include "harness/sampling/scene.h"
#include "harness/testing/example_media.h"

namespace {

thread_local std::uint64_t allocations = 0;

void* counted(void* memory) {
  ++allocations;
  if (!memory) throw std::bad_alloc();
  return memory;
}

}  // namespace

// Inlined, GCC takes pairs of them for mismatched ones.
[[gnu::noinline]] void* operator new(std::size_t size) { return counted(std::malloc(std::max<std::size_t>(1, size))); }
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto step = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(step, std::max<std::size_t>(1, (size + step - 1) / step) * step));
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace nullmark {

/// Ratio tracking that keeps its collisions in a fresh list each walk.
template <class Value>
struct Forgetful : RatioTracking<Value> {
  using RayData = MediumRay<Value>;
  struct Walk : RatioTracking<Value>::Walk {
    std::vector<Real> positions;
  };
  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.positions = std::vector<Real>();
  }
  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    RatioTracking<Value>::consume(walk, ray, at, extinction, rng);
    walk.positions.push_back(at.position());
  }
};

namespace {

/// What kernels are tried on: a medium, a majorant over it, and some rays through both.
struct Place {
  std::string name;
  MediumSpec spec;
  Scene scene;
};

/// Every registered medium at its defaults, grey and of three channels, and a sum, which has components; each under every
/// registered majorant that can bound it, and under one whose flights are cut.
std::vector<Place> places() {
  std::vector<MediumSpec> media;
  for (const ComponentInfo& entry : registered(ComponentKind::medium)) {
    MediumSpec grey;
    grey.field = example_medium(entry.name);
    media.push_back(grey);
    media.push_back(grey);
    media.back().spectrum = {0.5, 1, 2};
  }
  MediumSpec sum;
  sum.field.type = sum.field.label = "sum";
  sum.per_channel = {media.front(), media.front()};
  sum.per_channel[1].field = example_medium("linear");
  media.push_back(sum);

  std::vector<Place> all;
  for (const MediumSpec& spec : media) {
    const auto medium = std::make_shared<const BuiltMedium>(build_medium(spec));
    const Real bound = medium->extrema.maximum.maxCoeff();
    if (!std::isfinite(bound)) continue;
    const auto rays = std::make_shared<const BuiltRays>(build_rays({"chords", {{"count", 3}}, {}, {}}, *medium));
    std::vector<Component> majorants = {{"grid", {{"crossing", "rewind"}}, {}, {}}};
    for (const ComponentInfo& entry : registered(ComponentKind::majorant)) {
      if (entry.name == "vdb_nodes" && !medium->medium->has_nodes()) continue;
      majorants.push_back({entry.name, {}, {}, {}});
      if (entry.name == "prescribed") majorants.back().values["value"] = 1.5 * bound;
    }
    for (const Component& majorant : majorants) {
      Place place{fmt::format("{}, {} channels, {}", spec.field.type, medium->medium->channels(), majorant.type), spec, {}};
      place.scene.medium = medium;
      place.scene.rays = rays;
      place.scene.majorant = std::make_shared<const BuiltMajorant>(build_majorant(majorant, *medium));
      all.push_back(place);
    }
  }
  return all;
}

/// Allocations while samples are drawn that have been drawn before: memory has grown to what they need.
std::uint64_t allocations_of(const Kernel& kernel, const Scene& scene, Quantity quantity) {
  constexpr std::size_t kSamples = 300;  // more than a block
  const auto workspace = kernel.workspace();
  PreparedRay context;
  SampleBlock block;
  Counters counters;
  std::uint64_t found = 0;
  for (const bool again : {false, true})
    for (std::size_t ray = 0; ray < scene.rays->world.size(); ++ray) {
      scene.context(ray, kernel, context);
      kernel.begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
      const std::uint64_t before = allocations;
      kernel.sample(*workspace, *scene.medium->medium, context, 1, 0, kSamples, quantity, block, counters);
      if (again) found += allocations - before;
    }
  return found;
}

bool fits(const EstimatorSource& estimator, const Kernel& kernel, const BuiltMedium& medium, const BuiltRays& rays) {
  try {
    estimator.check(medium.extrema);
  } catch (const ParameterError&) {
    return false;
  }
  if (kernel.needs_knots() && !medium.medium->polynomial_degree()) return false;
  return !kernel.needs_optical_depth() || medium.medium->optical_depth(rays.local[0]);
}

TEST(Allocation, IsCounted) {
  const std::uint64_t before = allocations;
  std::vector<Real> grown(1);
  EXPECT_EQ(allocations, before + 1);
  struct alignas(64) Wide {
    Real x[8];
  };
  const auto wide = std::make_unique<Wide>();
  EXPECT_EQ(allocations, before + 2);
}

TEST(Allocation, NoneWhileTransmittancesAndFreePathsAreSampled) {
  std::map<std::string, int> tried;
  for (Place& place : places()) {
    const int channels = place.scene.medium->medium->channels();
    for (const Quantity quantity :
         {Quantity::transmittance, Quantity::optical_depth, Quantity::transmittance_profile, Quantity::free_path}) {
      place.scene.marks = nullptr;
      if (quantity == Quantity::transmittance_profile || quantity == Quantity::free_path)
        place.scene.marks = std::make_shared<const Marks>(compute_marks(*place.scene.medium, *place.scene.rays, quantity));
      for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
        if (entry.foreign) continue;
        const auto source = entry.make();
        const auto kernel = source->kernel(channels);
        // Trackers of one channel have none for spectra.
        if (!kernel || !fits(*source, *kernel, *place.scene.medium, *place.scene.rays) || !kernel->answers(quantity)) continue;
        EXPECT_EQ(allocations_of(*kernel, place.scene, quantity), 0u)
            << entry.name << ", quantity " << static_cast<int>(quantity) << ", " << place.name;
        ++tried[entry.name];
      }
    }
  }
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries())
    EXPECT_TRUE(entry.foreign || tried[entry.name] > 4) << entry.name;
}

TEST(Allocation, NoneWhilePathsAreTraced) {
  int tried = 0;
  for (Place& place : places()) {
    place.spec.albedo = {0.8};
    place.spec.anisotropy = 0.5;
    const BuiltMedium medium = build_medium(place.spec);
    TransportSpec transport;
    transport.environment = {1};
    transport.next_event = "phase";
    transport.surfaces = {{"sphere", {0.5, 0.5, 0.5}, {}, 0.1, {1}}};
    const TransportScene light = make_transport_scene(place.spec, medium, place.scene.majorant->structure, transport);
    for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
      if (entry.foreign) continue;
      const auto source = entry.make();
      if (!why_no_paths(*source, light).empty()) continue;
      EXPECT_EQ(allocations_of(*make_path_kernel(*source, light), place.scene, Quantity::radiance), 0u)
          << entry.name << ", " << place.name;
      ++tried;
    }
  }
  EXPECT_GT(tried, 500);
}

TEST(Allocation, AnAllocatingTrackerIsFoundOut) {
  for (const Place& place : places())
    if (place.spec.field.type == "homogeneous" && place.spec.spectrum.empty()) {
      EXPECT_GT(allocations_of(*EstimatorTemplate<Forgetful>().kernel(1), place.scene, Quantity::transmittance), 100u);
      EXPECT_EQ(allocations_of(*EstimatorTemplate<RatioTracking>().kernel(1), place.scene, Quantity::transmittance), 0u);
    }
}

}  // namespace
}  // namespace nullmark
