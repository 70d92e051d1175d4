#include "harness/run/judge_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>

#include "harness/io/json_input.h"
#include "harness/model/hash.h"
#include "harness/run/cell_record.h"
#include "harness/run/image.h"
#include "harness/sampling/test_families.h"
#include "harness/verdict/judge.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> images_of(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".exr") files.push_back(entry.path().string());
  if (error) throw InputError(fmt::format("{}: cannot be read: {}", folder, error.message()));
  if (files.empty()) throw InputError(folder + ": has no *.exr images");
  std::sort(files.begin(), files.end());
  return files;
}

/// The layers that are the channels, in their order: R, G and B where they are named so, else by name.  An alpha is left out.
std::vector<const Layer*> layers_of(const LayeredImage& image, int channels, const std::string& file) {
  std::map<std::string, const Layer*> named;
  for (const Layer& layer : image.layers)
    if (layer.name != "A") named[layer.name] = &layer;
  const bool rgb = named.size() == 3 && named.contains("R") && named.contains("G") && named.contains("B");
  if (rgb && channels == 3) return {named["R"], named["G"], named["B"]};
  // Renderers write grey pictures as three equal channels.
  if (rgb && channels == 1 && named["R"]->values == named["G"]->values && named["G"]->values == named["B"]->values)
    return {named["R"]};
  if (named.size() != static_cast<std::size_t>(channels))
    throw InputError(fmt::format("{}: found {} channels; the scene has {}", file, named.size(), channels));
  std::vector<const Layer*> layers;
  for (const auto& [name, layer] : named) layers.push_back(layer);
  return layers;
}

/// Adds the images in the order of their names.  Returns a hash of what they hold, and appends warnings.
std::uint64_t read_images(const std::string& folder, const BuiltRays& rays, int channels, PixelGroups& pictures,
                          std::vector<std::string>& warnings) {
  if (rays.width == 0) throw InputError(folder + ": the rays of the scene form no image; hand samples in as an .npy file");
  const std::vector<std::string> files = images_of(folder);
  const auto count = static_cast<std::size_t>(channels);
  std::vector<Real> picture(rays.world.size() * count);
  std::map<std::uint64_t, std::string> seen;
  std::string twice;
  std::uint64_t hash = fnv1a("");
  for (const std::string& file : files) {
    LayeredImage image;
    try {
      image = read_exr(file);
    } catch (const std::exception& error) {
      const std::string what = error.what();
      throw InputError(what.starts_with(file) ? what : fmt::format("{}: cannot be read: {}", file, what));
    }
    if (image.width != rays.width || image.height != rays.height)
      throw InputError(fmt::format("{}: found {} x {} pixels; the scene has {} x {}", file, image.width, image.height, rays.width,
                                   rays.height));
    const std::vector<const Layer*> layers = layers_of(image, channels, file);
    for (std::size_t c = 0; c < count; ++c)
      for (std::size_t ray = 0; ray < rays.world.size(); ++ray) picture[ray * count + c] = layers[c]->values[ray];
    const std::uint64_t of_picture = fnv1a({reinterpret_cast<const char*>(picture.data()), picture.size() * sizeof(Real)});
    hash = fnv1a({reinterpret_cast<const char*>(&of_picture), sizeof of_picture}, hash);
    const auto [at, fresh] = seen.emplace(of_picture, file);
    if (!fresh && twice.empty()) twice = fmt::format("{} and {} hold the same picture", at->second, file);
    pictures.add(picture);
  }
  if (!twice.empty() && seen.size() == 1) throw InputError(twice + ", and so do all; each image needs a seed of its own");
  if (!twice.empty()) warnings.push_back(twice + "; is each drawn with a seed of its own?");
  return hash;
}

/// Judges the groups of pixels one by one and gathers what they find.
class PictureJudging {
 public:
  PictureJudging(const Plan& plan, const PreparedCell& whole, const PixelGroups& pictures, const PictureSource& source,
                 const std::function<bool()>& stop)
      : plan_(plan),
        whole_(whole),
        pictures_(pictures),
        source_(source),
        stop_(stop),
        channels_(static_cast<std::size_t>(whole.scene->reference->channels)),
        margins_(channels_),
        families_{2 * pictures.groups() * channels_, lookups_family(plan), laws_family(plan)} {}

  std::optional<CellRecord> judged() {
    for (std::size_t group = 0; group < pictures_.groups(); ++group)
      for (std::size_t channel = 0; channel < channels_; ++channel)
        if (!add(group, channel)) return std::nullopt;
    // They would be those of means over pixels.
    record_.convergence.clear();
    record_.squared_error_blocks.clear();
    if (verdict_) decide(*verdict_, record_.outputs, record_.range);
    if (record_.status == Status::ok)
      add_verdict(record_, whole_, verdict_);
    else
      drop_sampled_statistics(record_);
    return std::move(record_);
  }

 private:
  /// Judges one series.  False where it was stopped.
  bool add(std::size_t group, std::size_t channel) {
    Cell cell = plan_.cells.front();
    PreparedCell named = whole_;
    named.cell = &cell;
    const PreparedCell prepared = group_cell(named, pictures_, group, channel, source_);
    // As of a group of rays: as many standard errors as in the test of them all.
    const Real mean = prepared.targets.mean[0];
    if (group > 0 && mean > 0) cell.verdict.epsilon = std::sqrt(static_cast<Real>(kRayGroups)) * margins_[channel] / mean;
    const DrawnPilot pilot = draw_pilot(prepared, stop_);
    const auto tests = tests_of(prepared, TestLevels{plan_.error_rates.alpha_pass, families_.means}, pilot);
    const auto sampled = sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets,
                                     {.per_ray = prepared.samples_per_ray}, tests ? &*tests : nullptr, stop_, [](double) {});
    if (!sampled) return false;
    Effort effort;
    std::optional<VerdictRecord> verdict;
    std::vector<KeptSamples> kept;
    if (pilot.kept) kept.push_back(*pilot.kept);
    const auto draw = [&](const SampleSpan& span) {
      return sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, span, &*tests, stop_,
                         [](double) {});
    };
    if (tests)
      verdict = judge(prepared, *tests, *sampled, kept,
                      draw_walk_laws(prepared, *tests, sampled->lookups_of_a_sample(), plan_.error_rates.alpha_pass, stop_),
                      plan_.error_rates, families_, effort, draw, stop_);
    if (stop_()) return false;
    if (group == 0) {
      if (tests && !tests->tests.empty()) margins_[channel] = tests->tests.front().epsilon;
      add_figures(prepared, *sampled, channel);
    }
    if (verdict) add_tests(*verdict, group, channel);
    return true;
  }

  /// Those of the mean of all pixels are the cell's.
  void add_figures(const PreparedCell& prepared, const Sampled& sampled, std::size_t channel) {
    PreparedCell told = prepared;
    told.cell = &plan_.cells.front();
    CellRecord record = blank_record(plan_, told);
    record.rays = whole_.scene->rays->world.size();
    fill_statistics(record, told, sampled);
    if (channel == 0) {
      record_ = std::move(record);
      return;
    }
    record_.channel.push_back(record.channel.front());
    record_.nonfinite += record.nonfinite;
    if (record_.status == Status::ok) {
      record_.status = record.status;
      record_.reason = record.reason;
    }
  }

  void add_tests(const VerdictRecord& of_series, std::size_t group, std::size_t channel) {
    const bool first = !verdict_;
    if (first) {
      verdict_ = of_series;
      verdict_->tests.clear();
    }
    const int number = static_cast<int>(group) - 1;
    for (TestRecord test : of_series.tests) {
      test.group = number;
      test.channel = static_cast<int>(channel);
      verdict_->tests.push_back(std::move(test));
    }
    if (first) return;
    // Why a series cannot be decided says more than that it is open.
    if (!verdict_->planned_undecidable && of_series.planned_undecidable)
      verdict_->reason = number < 0 ? of_series.reason : fmt::format("ray group {}: {}", number, of_series.reason);
    verdict_->planned_undecidable |= of_series.planned_undecidable;
    verdict_->planned = std::max(verdict_->planned, of_series.planned);
    verdict_->out_of_range += of_series.out_of_range;
    verdict_->nonfinite += of_series.nonfinite;
  }

  const Plan& plan_;
  const PreparedCell& whole_;
  const PixelGroups& pictures_;
  const PictureSource& source_;
  const std::function<bool()>& stop_;
  std::size_t channels_;
  std::vector<Real> margins_;  ///< of the mean of all pixels, per channel
  Families families_;
  CellRecord record_;
  std::optional<VerdictRecord> verdict_;
};

}  // namespace

std::optional<CellRecord> judge_pictures(const Plan& plan, const PreparedCell& whole, const PixelGroups& pictures,
                                         const PictureSource& source, const std::function<bool()>& stop) {
  return PictureJudging(plan, whole, pictures, source, stop).judged();
}

AddPictures images_in(const std::string& folder) {
  return [folder](const BuiltRays& rays, int channels, PixelGroups& pictures, std::vector<std::string>& warnings) {
    return read_images(folder, rays, channels, pictures, warnings);
  };
}

std::optional<JudgedImages> judge_images(const ProblemScene& scene, const std::string& samples, const std::string& estimator,
                                         SampleRange range, const AddPictures& add, const std::function<bool()>& stop) {
  const Plan built = scene.plan();
  const PreparedCell whole = CellPreparer(built).prepare(0);
  const int channels = whole.scene->reference->channels;
  PixelGroups pictures(*whole.scene->rays, channels);
  JudgedImages judged;
  const std::uint64_t hash = add(*whole.scene->rays, channels, pictures, judged.warnings);
  constexpr std::uint64_t kFewest = 4;
  if (pictures.pictures() < kFewest)
    throw InputError(fmt::format("{}: found {} images; expected at least {}", samples, pictures.pictures(), kFewest));
  judged.plan = scene.plan(estimator, split_samples(pictures.pictures()).judged, samples);
  const PictureSource source{judged.plan.cells[0].estimator->label, hash, range};
  auto record = judge_pictures(judged.plan, whole, pictures, source, stop);
  if (!record) return std::nullopt;
  judged.record = *std::move(record);
  return judged;
}

}  // namespace nullmark
