#include "harness/run/problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "harness/config/config.h"
#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/npy.h"
#include "harness/io/spec_json.h"
#include "harness/model/names.h"
#include "harness/registry/environment_variables.h"
#include "harness/run/problem_text.h"
#include "harness/run/problem_volume.h"
#include "harness/sampling/cell_preparation.h"
#include "media/volumes/vdb_writer.h"

namespace nullmark {
namespace {

namespace fs = std::filesystem;

constexpr const char *kFile = "problem.json", *kVolumeType = "vdb";

/// Of other quantities a sample is no single number of a ray.
bool is_written(Quantity quantity) { return quantity == Quantity::transmittance || quantity == Quantity::optical_depth; }

/// With the pointer of the component that it complains of.
std::string told(const std::string& pointer, const ParameterError& error) {
  return fmt::format("{}{}{}: {}", pointer, error.parameter.empty() ? "" : "/", error.parameter, error.what());
}

/// Media of a problem name files in its folder.
void locate_media(Plan& plan, const std::string& folder) {
  const auto locate = [&](MediumSpec& medium) {
    const auto file = medium.field.values.find("file");
    if (medium.field.type != kVolumeType || file == medium.field.values.end()) return;
    auto* const path = std::get_if<std::string>(&file->second);
    if (path && fs::path(*path).is_relative() && !path->starts_with("${")) *path = (fs::path(folder) / *path).string();
  };
  for (Shared<MediumSpec>& medium : plan.media) medium.edit(locate);
}

std::string text_of(const MediumSpec& medium, const char* key, const std::string& otherwise) {
  const auto at = medium.field.values.find(key);
  const auto* text = at == medium.field.values.end() ? nullptr : std::get_if<std::string>(&at->second);
  return text ? *text : otherwise;
}

/// A folder of nothing but what this program writes: it does not stay behind where that fails.
class FreshFolder {
 public:
  explicit FreshFolder(const std::string& folder)
      : folder_(folder), exists_(fs::exists(folder)), empty_(!exists_ || fs::is_empty(folder)) {}
  FreshFolder(const FreshFolder&) = delete;
  FreshFolder& operator=(const FreshFolder&) = delete;
  ~FreshFolder() {
    std::error_code error;
    if (kept_ || !empty_) return;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) fs::remove_all(entry.path(), error);
    if (!exists_) fs::remove(folder_, error);
  }
  void keep() { kept_ = true; }

 private:
  std::string folder_;
  bool exists_, empty_, kept_ = false;
};

void prepare_folder(const std::string& folder, bool force) {
  std::error_code error;
  if (!force && fs::exists(folder, error) && !fs::is_empty(folder, error))
    throw InputError(folder + ": is not empty; --force writes into it");
  for (const char* part : {"volumes", "rays"}) {
    fs::create_directories(fs::path(folder) / part, error);
    if (error) throw InputError(fmt::format("{}: cannot be made: {}", folder, error.message()));
  }
}

/// Writes the scenes of a plan into a folder.
class ProblemWriter {
 public:
  ProblemWriter(const Plan& plan, const ProblemOptions& options) : plan_(plan), options_(options) {
    problem_.name = plan.name;
    problem_.error_rates = plan.error_rates;
    problem_.timing.enabled = false;
    problem_.ray_sets = plan.ray_sets;
    problem_.majorants.resize(1);
    problem_.majorants[0].edit([](Component& majorant) { majorant.type = "global"; });
  }

  std::vector<std::string> write() {
    choose();
    std::error_code error;
    if (fs::exists(options_.folder, error) && !fs::is_directory(options_.folder, error))
      throw InputError(options_.folder + ": is no folder; expected a new one");
    FreshFolder fresh(options_.folder);
    prepare_folder(options_.folder, options_.force);
    for (std::size_t i = 0; i < problem_.cells.size(); ++i) write_medium(i);
    const std::string config = applied_config(problem_);
    Plan built = read_config(config, path(kFile));
    locate_media(built, options_.folder);
    CellPreparer preparer(built);
    Json scenes = Json::array();
    for (std::size_t i = 0; i < built.cells.size(); ++i) scenes.push_back(scene_json(i, *preparer.prepare(i).scene, scenes));
    const Json problem = {{kVersionKey, kProblemVersion},
                          {"name", plan_.name},
                          {"scenes", std::move(scenes)},
                          {"config", parse_json(config, kFile)}};
    write_atomically(path("README.md"), problem_readme(plan_.name, options_.answers));
    write_atomically(path(kFile), problem.dump(1) + "\n");
    fresh.keep();
    return std::move(left_out_);
  }

 private:
  std::string path(const std::string& name) const { return (fs::path(options_.folder) / name).string(); }
  const std::string& id(std::size_t scene) const { return problem_.cells[scene].experiment; }
  /// The first scene of the same medium.
  std::size_t first_of(std::size_t scene) const {
    return static_cast<std::size_t>(std::find(originals_.begin(), originals_.end(), originals_[scene]) - originals_.begin());
  }
  const MediumSpec& original(std::size_t scene) const { return *plan_.media[originals_[scene]]; }

  /// The cells of the problem, one for each scene.
  void choose() {
    std::set<std::string> other;
    for (const Cell& cell : plan_.cells) {
      if (!is_written(cell.quantity)) {
        other.insert(fmt::format("quantity {}: only transmittance and optical_depth are written", to_string(cell.quantity)));
        continue;
      }
      const auto same = [&](const Cell& one) {
        return originals_[one.medium] == cell.medium && one.rays == cell.rays && one.quantity == cell.quantity &&
               one.transport.surfaces == cell.transport.surfaces;
      };
      if (std::any_of(problem_.cells.begin(), problem_.cells.end(), same)) continue;
      const MediumSpec& medium = *plan_.media[cell.medium];
      if (medium.field.type == "channels")
        throw InputError(fmt::format("{}: found a medium of {} fields; expected a grey one, or one field with a \"spectrum\"",
                                     medium.field.pointer, medium.per_channel.size()));
      if (const std::string missing = why_missing(cell); !missing.empty()) {
        other.insert(missing);
        continue;
      }
      Cell scene;
      scene.experiment = std::to_string(problem_.cells.size());
      scene.estimator = Component{"ratio", {}, "", ""};
      scene.medium = problem_.cells.size();
      scene.rays = cell.rays;
      scene.quantity = cell.quantity;
      scene.transport.surfaces = cell.transport.surfaces;
      scene.seed = cell.seed;
      scene.verdict.epsilon = cell.verdict.epsilon;
      scene.verdict.tolerate = cell.verdict.tolerate;
      scene.verdict.laws = LawPolicy::never;
      originals_.push_back(cell.medium);
      problem_.cells.push_back(std::move(scene));
    }
    left_out_.assign(other.begin(), other.end());
    if (problem_.cells.empty())
      throw InputError(fmt::format("{}: no cell has the quantity transmittance or optical_depth; nothing to write", plan_.name));
  }

  /// Why the medium of a cell cannot be had, if it need not be.  Throws InputError, in the words of the configuration, where it
  /// or the rays cannot be built.
  std::string why_missing(const Cell& cell) {
    const MediumSpec& spec = *plan_.media[cell.medium];
    std::string where = spec.field.pointer;
    try {
      std::optional<BuiltMedium>& built = built_[cell.medium];
      if (!built) built = build_medium(spec);
      const Component& rays = *plan_.ray_sets[cell.rays];
      where = rays.pointer;
      build_rays(rays, *built);
      return "";
    } catch (const MissingData& error) {
      if (spec.optional) return error.what();
      throw InputError(fmt::format("{}/file: {}; say \"optional\": true to leave it out", spec.field.pointer, error.what()));
    } catch (const ParameterError& error) {
      throw InputError(told(where, error));
    }
  }

  /// The medium of a scene, as a volume.
  void write_medium(std::size_t scene) {
    MediumSpec spec = original(scene);
    spec.emission.clear();
    spec.emission_field.clear();
    spec.albedo_field.clear();
    spec.optional = false;
    if (const std::size_t first = first_of(scene); first < scene) {
      problem_.media.push_back(problem_.media[first]);
      return;
    }
    if (spec.field.type == kVolumeType) {
      const std::string file = text_of(spec, "file", "");
      // Variables stay, because they are another machine's to set.
      if (!file.starts_with("${")) spec.field.values["file"] = fs::absolute(file).string();
    } else {
      spec.field = sampled_field(scene);
      spec.per_channel.clear();
    }
    problem_.media.push_back(std::move(spec));
  }

  /// A medium that is no volume becomes one.
  Component sampled_field(std::size_t scene) {
    MediumSpec grey = original(scene);
    grey.spectrum.clear();
    grey.albedo.clear();
    grey.albedo_field.clear();
    for (MediumSpec& part : grey.per_channel) part.albedo.clear();
    const std::string name = grey.field.pointer;
    try {
      const BuiltMedium built = build_medium(grey);
      if (built.medium->channels() > 1)
        throw InputError(fmt::format("{}: found a medium \"{}\" of {} channels; expected a grey one, or one with a \"spectrum\"",
                                     name, grey.label, built.medium->channels()));
      const DenseGrid grid = sampled_grid(*built.medium, options_.resolution, name);
      const std::string file = fmt::format("volumes/{}.vdb", id(scene));
      write_dense_vdb(path(file), grid.shape, grid.values, grid.index_to_world);
      Component volume;
      volume.type = kVolumeType;
      volume.values["file"] = file;
      return volume;
    } catch (const ParameterError& error) {
      throw InputError(told(name, error));
    }
  }

  Json scene_json(std::size_t index, const Scene& scene, const Json& scenes) const {
    const BuiltRays& rays = *scene.rays;
    const BuiltMedium& medium = *scene.medium;
    const std::string ray_file = fmt::format("rays/{}.npy", id(index));
    write_rays(path(ray_file), rays);
    const auto three = [](const Vec3& p) { return Json{p.x(), p.y(), p.z()}; };
    const auto each = [](const Spectrum& x) { return std::vector<Real>(x.begin(), x.end()); };
    Json json = {{"id", id(index)},
                 {"quantity", to_string(problem_.cells[index].quantity)},
                 {"channels", medium.medium->channels()},
                 {"medium", {{"label", original(index).label}, {"parameters", medium_json(original(index))}}},
                 {"bounds", {{"lo", three(medium.world_bounds.lo)}, {"hi", three(medium.world_bounds.hi)}}},
                 {"maximum_extinction", each(medium.extrema.maximum)},
                 {"minimum_extinction", each(medium.extrema.minimum)}};
    if (!original(index).spectrum.empty()) json["spectrum"] = original(index).spectrum;
    const std::size_t first = first_of(index);
    json["volume"] = first < index ? scenes[first]["volume"] : volume_json(index);
    json["rays"] = {{"file", ray_file}, {"count", rays.world.size()}, {"width", rays.width}, {"height", rays.height}};
    if (options_.answers) json["answers"] = write_answers(index, *scene.reference);
    return json;
  }

  Json volume_json(std::size_t index) const {
    const MediumSpec& medium = *problem_.media[index];
    const std::string file = text_of(medium, "file", ""), grid = text_of(medium, "grid", "density"),
                      interpolation = text_of(medium, "interpolation", "trilinear"),
                      raw = fmt::format("volumes/{}.raw", id(index));
    Json json = {{"vdb", file}, {"grid", grid}, {"interpolation", interpolation}, {"extinction_per_value", 1.}};
    const auto factor = medium.field.values.find("extinction_per_value");
    if (factor != medium.field.values.end()) json["extinction_per_value"] = std::get<Real>(factor->second);
    const std::string here = (fs::path(options_.folder) / with_variables(file)).string();
    const DenseGrid dense = active_grid(here, grid, interpolation == "trilinear" ? 1 : 0);
    json.update(grid_json(dense));
    json["raw"] = dense.values.empty() ? Json() : Json(raw);
    if (!dense.values.empty()) write_raw(path(raw), dense.values);
    return json;
  }

  static void write_rays(const std::string& file, const BuiltRays& rays) {
    constexpr std::size_t kNumbers = 8;
    std::vector<Real> numbers;
    numbers.reserve(rays.world.size() * kNumbers);
    for (const Ray& ray : rays.world)
      for (const Real number : {ray.origin.x(), ray.origin.y(), ray.origin.z(), ray.direction.x(), ray.direction.y(),
                                ray.direction.z(), ray.begin, ray.end})
        numbers.push_back(number);
    write_atomically(file, npy_text({rays.world.size(), kNumbers}, numbers));
  }

  std::string write_answers(std::size_t index, const Reference& reference) const {
    std::vector<Real> exact = reference.depth;
    if (problem_.cells[index].quantity == Quantity::transmittance)
      for (Real& value : exact) value = std::exp(-value);
    const auto channels = static_cast<std::size_t>(reference.channels);
    const std::string file = fmt::format("answers/{}.npy", id(index));
    std::error_code error;
    fs::create_directories(path("answers"), error);
    write_atomically(path(file), npy_text({exact.size() / channels, channels}, exact));
    return file;
  }

  const Plan& plan_;
  const ProblemOptions& options_;
  Plan problem_;                                             ///< what `judge` reads: scene i has medium i
  std::vector<std::size_t> originals_;                       ///< its medium in the plan
  std::map<std::size_t, std::optional<BuiltMedium>> built_;  ///< media of the plan
  std::vector<std::string> left_out_;
};

}  // namespace

std::vector<std::string> write_problem(const Plan& plan, const ProblemOptions& options) {
  return ProblemWriter(plan, options).write();
}

ProblemScene ProblemScene::read(const std::string& folder, const std::string& id) {
  const std::string file = (fs::path(folder) / kFile).string();
  std::error_code error;
  if (const auto type = fs::status(folder, error).type(); type == fs::file_type::not_found)
    throw InputError(fmt::format("{}: no such folder; `nullmark problem CONFIG -o {}` writes it", folder, folder));
  else if (type != fs::file_type::directory)
    throw InputError(folder + ": is no folder; expected one that `nullmark problem` wrote");
  if (fs::status(file, error).type() == fs::file_type::not_found)
    throw InputError(file + ": no such file; expected a folder that `nullmark problem` wrote");
  const Json problem = parse_json(read_file(file), file);
  const JsonNode top(problem, file);
  top.expect_object();
  if (!top.has(kVersionKey) || top[kVersionKey].json() != Json(kProblemVersion))
    throw InputError(
        fmt::format("{}: expected \"{}\": \"{}\"; write it with `nullmark problem`", file, kVersionKey, kProblemVersion));
  if (!top.has("config")) throw InputError(file + ": has no \"config\"; write it again with `nullmark problem`");
  // Checks the whole of it, once.
  const Plan plan = read_config(problem["config"].dump(), file);
  std::vector<std::string> ids;
  for (const Cell& cell : plan.cells) ids.push_back(cell.experiment);
  if (id.empty() && ids.size() > 1)
    throw InputError(fmt::format("{}: has {} scenes; give --scene with one of {}", file, ids.size(), fmt::join(ids, ", ")));
  const auto at = id.empty() ? ids.begin() : std::find(ids.begin(), ids.end(), id);
  if (at == ids.end()) throw InputError(fmt::format("{}: has no scene \"{}\"; it has {}", file, id, fmt::join(ids, ", ")));
  Plan one = plan;
  one.cells = {plan.cells[static_cast<std::size_t>(at - ids.begin())]};
  if (!is_written(one.cells[0].quantity))
    throw InputError(fmt::format("{}: found quantity \"{}\" in scene \"{}\"; expected transmittance or optical_depth", file,
                                 to_string(one.cells[0].quantity), *at));
  ProblemScene scene;
  scene.id_ = *at;
  scene.folder_ = folder;
  scene.config_ = applied_config(one);
  return scene;
}

Plan ProblemScene::plan(const std::string& estimator, std::uint64_t samples_per_ray, const std::string& file) const {
  Json config = known_json(config_);
  Json& cell = config["experiments"][0]["include"][0];
  cell["estimator"] = parse_json(estimator, file);
  cell["samples_per_ray"] = samples_per_ray;
  cell["verdict"]["enabled"] = true;
  cell["verdict"]["laws"] = "never";
  cell["verdict"]["max_samples_per_ray"] = samples_per_ray;
  Plan plan = read_config(config.dump(), file);
  locate_media(plan, folder_);
  return plan;
}

Plan ProblemScene::plan() const {
  Plan plan = read_config(config_, (fs::path(folder_) / kFile).string());
  locate_media(plan, folder_);
  return plan;
}

}  // namespace nullmark
