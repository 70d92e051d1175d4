#include "harness/sampling/cell_preparation.h"

#include <fmt/format.h>
#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "harness/kernel/difference_kernel.h"
#include "harness/kernel/path_kernel.h"
#include "harness/model/in_flight.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"
#include "harness/sampling/build_transport.h"
#include "harness/sampling/failure.h"
#include "harness/sampling/ray_memory.h"

namespace nullmark {
namespace {

/// Adds the component's JSON pointer to what its construction complains of.
template <class F>
auto located(const std::string& pointer, F&& f) {
  try {
    return f();
  } catch (const ParameterError& error) {
    throw ParameterError(error.parameter.empty() ? pointer : pointer + "/" + error.parameter, error.what());
  }
}

/// Flights in float are told to 2^-24 of the ray's depth: here still a thousandth of a mean free path.
constexpr Real kDeepestSingle = 1 << 14;
/// Of a medium from its frame's origin, in its own sizes: its inside is still told to 2^-14.
constexpr Real kFarthestSingle = 1 << 10, kFarthestDouble = 0x1p39;
/// Of the end of a ray from its origin, in sizes of the medium.
constexpr Real kFarthestRaySingle = 1 << 14, kFarthestRayDouble = 0x1p43;

template <class Key, class Value, class Make>
std::shared_ptr<const Value> once(std::map<Key, std::shared_ptr<const Value>>& cache, const Key& key, Make&& make) {
  std::shared_ptr<const Value>& entry = cache[key];
  if (!entry) entry = make();
  return entry;
}

}  // namespace

PreparedCell CellPreparer::prepare(std::size_t index) {
  const Cell& cell = plan_.cells[index];
  PreparedCell prepared = unprepared(plan_, index);
  const InFlight named(cell.name);
  const MediumSpec& spec = *plan_.media[cell.medium];
  if (const auto missing = missing_.find(cell.medium); missing != missing_.end()) {
    prepared.reason = missing->second;
    return prepared;
  }
  try {
    prepared.scene = scene(cell);
  } catch (const MissingData& error) {
    if (!spec.optional)
      throw ParameterError(spec.field.pointer + "/file",
                           std::string(error.what()) + "; say \"optional\": true to skip such cells");
    prepared.reason = missing_[cell.medium] = error.what();
    return prepared;
  }
  prepared.failure = tracker_failure([&] { add_kernel(prepared); });
  if (!prepared.failure.empty()) prepared.reason = prepared.failure;
  return prepared;
}

/// The kernel of a cell whose scene is built, and what its samples should average to.
void CellPreparer::add_kernel(PreparedCell& prepared) {
  const Cell& cell = *prepared.cell;
  add_tracker(prepared, *cell.estimator);
  if (cell.minus && prepared.reason.empty()) subtract(prepared, **cell.minus);
  if (!prepared.reason.empty()) return;
  prepared.targets = compute_targets(*prepared.scene, *prepared.kernel, cell.quantity,
                                     cell.minus ? std::optional<GivenReference>() : cell.reference);
  if (!cell.minus) return;
  prepared.targets.error.assign(prepared.targets.error.size(), 0);
  prepared.targets.method = "difference";
}

/// Both trackers of a difference must be unbiased for its mean to be 0, and where both have samples in [0, 1] it lies in [-1, 1].
void CellPreparer::subtract(PreparedCell& prepared, const Component& tracker) {
  if (Registry<EstimatorEntry>::instance().find(tracker.type)->foreign)
    throw ParameterError(
        tracker.pointer,
        fmt::format("found the tracker \"{}\" from outside; expected one of nullmark to subtract", tracker.type));
  PreparedCell second = prepared;
  add_tracker(second, tracker);
  prepared.reason = second.reason;
  if (!prepared.reason.empty()) return;
  const auto honest = [](Guarantee claim) { return claim == Guarantee::unbiased || claim == Guarantee::exact; };
  const auto in_unit = [](SampleRange range) { return range == SampleRange::binary || range == SampleRange::unit; };
  prepared.claim = honest(prepared.claim) && honest(second.claim) ? Guarantee::unbiased : Guarantee::biased;
  prepared.range = in_unit(prepared.range) && in_unit(second.range) ? SampleRange::unit : SampleRange::any_sign;
  prepared.needs_bound |= second.needs_bound;
  prepared.takes_part |= second.takes_part;
  prepared.subtracted = second.kernel;
  prepared.kernel = make_difference_kernel(prepared.kernel, second.kernel);
  if (!prepared.kernel->answers(prepared.cell->quantity))
    prepared.reason = fmt::format("differences of a {} are not drawn", to_string(prepared.cell->quantity));
}

/// A tracker for a cell whose scene is built.
void CellPreparer::add_tracker(PreparedCell& prepared, const Component& tracker) {
  const Cell& cell = *prepared.cell;
  const std::shared_ptr<const EstimatorSource> source = located(tracker.pointer, [&] { return make_estimator(tracker); });
  located(tracker.pointer, [&] {
    try {
      source->check(prepared.scene->medium->extrema);
    } catch (const ParameterError& error) {
      // Of a swept medium the tracker's pointer says nothing.
      throw ParameterError(error.parameter, fmt::format("{} (medium {})", error.what(), plan_.media[cell.medium]->label));
    }
    return 0;
  });
  // A tracker from outside is opened here.
  located(tracker.pointer, [&] {
    prepared.claim = source->claim(cell.quantity);
    prepared.range = source->range(prepared.scene->medium->medium->channels());
    prepared.needs_bound = source->needs_bound();
    return 0;
  });
  prepared.source = source;
  if (cell.quantity == Quantity::radiance && cell.precision == Precision::float64) {
    add_light(prepared, *source);
  } else {
    prepared.kernel = source->kernel(prepared.scene->medium->medium->channels(), cell.precision, cell.lanes);
    prepared.reason = why_not(cell, tracker, *prepared.scene, prepared.kernel.get());
  }
}

/// The kernel of a radiance, composed from the scene's effects.
void CellPreparer::add_light(PreparedCell& prepared, const EstimatorSource& source) const {
  const Cell& cell = *prepared.cell;
  const TransportScene light = located(plan_.media[cell.medium]->field.pointer, [&] {
    return make_transport_scene(*plan_.media[cell.medium], *prepared.scene->medium, prepared.scene->majorant->structure,
                                cell.transport);
  });
  const Effects effects = cell.transport.general ? Effects{} : effects_of(light);
  prepared.effects = effect_names(effects);
  prepared.reason = brightest(light) > 0 ? why_no_paths(source, light, cell.transport.general)
                                         : "nothing emits; give \"environment\", \"emission\" or the \"radiance\" of surfaces";
  if (!prepared.reason.empty()) return;
  prepared.takes_part = effects.heterogeneous;
  prepared.kernel = make_path_kernel(source, light, cell.transport.general);
  // A path whose flights have weight 1 carries the radiance of one place; with next events it adds up several.
  const bool one_place = (prepared.range == SampleRange::binary || prepared.range == SampleRange::unit) &&
                         light.options.next_event == NextEvent::off && light.medium->channels() == 1 &&
                         prepared.scene->bounding && brightest(light) <= 1;
  prepared.range = one_place                                 ? SampleRange::unit
                   : prepared.range == SampleRange::any_sign ? SampleRange::any_sign
                                                             : SampleRange::non_negative;
}

namespace {

bool answers_on_grey_media(const Component& tracker, Quantity quantity) {
  const std::vector<Quantity>& answered = Registry<EstimatorEntry>::instance().find(tracker.type)->quantities;
  return std::find(answered.begin(), answered.end(), quantity) != answered.end();
}

/// ", or a tracker that does: spectral"; empty if there is none.
std::string trackers_for(Quantity quantity, int channels) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> names;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries())
    if (!entry.foreign && !entry.planted && names.size() < kNamed)
      if (const auto kernel = entry.make()->kernel(channels); kernel && kernel->answers(quantity)) names.push_back(entry.name);
  return names.empty() ? "" : fmt::format(", or a tracker that does: {}", fmt::join(names, ", "));
}

}  // namespace

std::string CellPreparer::why_not(const Cell& cell, const Component& tracker, const Scene& scene, const Kernel* made) {
  const int channels = scene.medium->medium->channels();
  if (!made && !cell.lanes && make_estimator(tracker)->kernel(channels, cell.precision))
    return fmt::format("{} has no walks one at a time in float; expected \"lanes\": true or precision \"double\"", tracker.type);
  if (!made && channels == 1 && make_estimator({tracker.type, {}, {}, {}})->kernel(1, cell.precision))
    return fmt::format("{} has no form in float with these parameters; expected its defaults or precision \"double\"",
                       tracker.type);
  if (!made)
    return channels > 1 ? fmt::format("{} channels have no form in float; expected precision \"double\"", channels)
                        : fmt::format("{} has no form in float; expected precision \"double\"", tracker.type);
  const Kernel& kernel = *made;
  if (!kernel.answers(cell.quantity) && channels > 1 && answers_on_grey_media(tracker, cell.quantity))
    return fmt::format("{} does not answer {} on {} channels; take a grey medium{}", tracker.type, to_string(cell.quantity),
                       channels, trackers_for(cell.quantity, channels));
  if (!kernel.answers(cell.quantity))
    return fmt::format("{} does not answer {}{}", tracker.type, to_string(cell.quantity),
                       cell.precision == Precision::float32 ? " in float" : "");
  if (scene.medium->albedo_field && cell.quantity == Quantity::free_path &&
      Registry<EstimatorEntry>::instance().find(tracker.type)->foreign)
    return "trackers from outside are told one albedo for a ray, and the medium's varies";
  const bool single = cell.precision == Precision::float32;
  const Box box = scene.medium->medium->bounds();
  const Real farthest = single ? kFarthestSingle : kFarthestDouble;
  if (box.lo.cwiseAbs().cwiseMax(box.hi.cwiseAbs()).maxCoeff() > farthest * box.extent().minCoeff())
    return fmt::format(
        "the medium lies over {:g} times its size from the origin of its frame, where {} has no digits for a position; expected "
        "it "
        "nearer{}",
        farthest, single ? "float" : "double", single ? ", or \"double\"" : "");
  // A point is the ray's origin plus a distance along it, in the medium's frame.
  const Real farthest_ray = single ? kFarthestRaySingle : kFarthestRayDouble;
  for (const Ray& ray : scene.rays->local)
    if (ray.length() > 0 &&
        std::max(std::abs(ray.begin), std::abs(ray.end)) * ray.direction.norm() > farthest_ray * box.extent().minCoeff())
      return fmt::format(
          "a ray begins over {:g} times the medium's size away, where {} has no digits for a distance; expected it nearer{}",
          farthest_ray, single ? "float" : "double", single ? ", or \"double\"" : "");
  if (const Real depth = single ? deepest_majorant(scene) : 0; depth > kDeepestSingle)
    return fmt::format("rays of majorant depth {:.6g} leave float no digits for a flight; expected at most {}, or \"double\"",
                       depth, kDeepestSingle);
  if (kernel.needs_knots() && !scene.medium->medium->polynomial_degree())
    return "no exact traversal: the medium is not polynomial between knots";
  if (kernel.needs_optical_depth() && scene.reference->method != "closed_form")
    return "the medium has no closed-form optical depth";
  return "";
}

Real CellPreparer::deepest_majorant(const Scene& scene) {
  const auto [known, fresh] = deepest_.try_emplace(&scene, 0);
  if (!fresh) return known->second;
  Real& deepest = known->second;
  RayBounds bounds;
  Rates rates;
  for (std::size_t ray = 0; ray < scene.rays->world.size(); ++ray) {
    bounds.start(*scene.majorant->structure, scene.rays->world[ray], scene.rays->local[ray]);
    bounds.start_rates(scene.rays->world[ray].begin, rates);
    deepest = std::max(deepest, rates.total_depth());
  }
  return deepest;
}

std::shared_ptr<const BuiltMedium> CellPreparer::medium(std::size_t index) {
  return once(media_, index, [&] {
    return located(plan_.media[index]->field.pointer,
                   [&] { return std::make_shared<const BuiltMedium>(build_medium(*plan_.media[index])); });
  });
}

void CellPreparer::build_media(const std::vector<std::size_t>& cells) {
  std::set<std::size_t> wanted;
  for (const std::size_t i : cells)
    if (!media_.contains(plan_.cells[i].medium)) wanted.insert(plan_.cells[i].medium);
  std::vector<std::pair<std::size_t, std::shared_ptr<const BuiltMedium>>> built;
  for (const std::size_t medium : wanted) built.emplace_back(medium, nullptr);
  tbb::parallel_for_each(built.begin(), built.end(), [&](auto& each) {
    try {
      each.second = std::make_shared<const BuiltMedium>(build_medium(*plan_.media[each.first]));
    } catch (const std::exception&) {
      // Built again by its cell, which says why it fails.
    }
  });
  for (const auto& [medium, done] : built)
    if (done) media_.emplace(medium, done);
}

std::string CellPreparer::medium_hash(std::size_t index) {
  try {
    return hash_text(*medium(index));
  } catch (const MissingData&) {
    return "";
  }
}

std::shared_ptr<const Scene> CellPreparer::scene(const Cell& cell) {
  const bool told_at_marks = cell.quantity == Quantity::transmittance_profile || cell.quantity == Quantity::free_path;
  const std::size_t kind = told_at_marks ? static_cast<std::size_t>(cell.quantity) : 0;
  // Surfaces end rays; a radiance looks for them itself, along every leg of its paths.
  const std::vector<SurfaceSpec> surfaces =
      cell.quantity == Quantity::radiance ? std::vector<SurfaceSpec>{} : cell.transport.surfaces;
  const std::size_t cut = static_cast<std::size_t>(std::find(cuts_.begin(), cuts_.end(), surfaces) - cuts_.begin());
  if (cut == cuts_.size()) cuts_.push_back(surfaces);
  return once(scenes_, std::array{cell.medium, cell.majorant, cell.rays, kind, cut}, [&] {
    const auto medium = this->medium(cell.medium);
    const Component& majorant = *plan_.majorants[cell.majorant];
    const auto structure = once(structures_, std::array{cell.medium, cell.majorant}, [&] {
      return located(majorant.pointer, [&] { return std::make_shared<const BuiltMajorant>(build_majorant(majorant, *medium)); });
    });
    const Component& set = *plan_.ray_sets[cell.rays];
    const auto rays = once(rays_, std::array{cell.medium, cell.rays, cut}, [&] {
      return located(set.pointer, [&] {
        return std::make_shared<const BuiltRays>(
            thinned(cut_at(build_surfaces(surfaces, 1), build_rays(set, *medium)), most_rays_));
      });
    });
    const auto reference = once(references_, std::array{cell.medium, cell.rays, cut},
                                [&] { return std::make_shared<const Reference>(compute_reference(*medium, *rays)); });
    std::shared_ptr<const Marks> marks;
    if (told_at_marks)
      marks = once(marks_, std::array{cell.medium, cell.rays, kind, cut},
                   [&] { return std::make_shared<const Marks>(compute_marks(*medium, *rays, cell.quantity)); });
    const bool bounding = bounds_everywhere(*structure->structure, *rays);
    const bool exceeds = !bounding && exceeds_somewhere(*medium, *structure->structure, *rays);
    return std::make_shared<const Scene>(Scene{medium, structure, rays, reference, marks, bounding, exceeds});
  });
}

PreparedCell unprepared(const Plan& plan, std::size_t index) {
  PreparedCell prepared;
  prepared.cell = &plan.cells[index];
  prepared.index = index;
  prepared.samples_per_ray = prepared.cell->samples_per_ray;
  return prepared;
}

bool is_from_outside(const Cell& cell) {
  const auto outside = [](const Component& tracker) { return Registry<EstimatorEntry>::instance().find(tracker.type)->foreign; };
  return outside(*cell.estimator) || (cell.minus && outside(**cell.minus));
}

std::vector<PreparedCell> prepare_all(CellPreparer& preparer, const Plan& plan, const std::function<bool(std::size_t)>& wanted,
                                      const std::function<bool()>& stop) {
  expect_rays_fit(plan, wanted);
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    if (wanted(i)) places.push_back(i);
  std::vector<PreparedCell> cells;
  cells.reserve(places.size());
  if (!stop()) preparer.build_media(places);
  for (const std::size_t i : places) cells.push_back(stop() ? unprepared(plan, i) : preparer.prepare(i));
  return cells;
}

}  // namespace nullmark
