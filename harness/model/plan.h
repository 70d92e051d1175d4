#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "estimators/walk/quantity.h"
#include "harness/model/published_claim.h"
#include "harness/model/shared.h"

namespace nullmark {

/// Cells of a configuration and of its results, at most.  Otherwise a few lists in a small file could fill memory.
inline constexpr std::size_t kMostCells = 100'000;

using ParameterValue =
    std::variant<Real, int, bool, std::string, std::vector<Real>, std::array<Real, 3>, std::vector<std::string>>;
/// By parameter name; defaults are filled in.
using ParameterValues = std::map<std::string, ParameterValue>;

/// A registered type with its parameters: an estimator, a medium's field, a majorant structure or a ray set.
struct Component {
  std::string type;
  ParameterValues values;
  std::string label;    ///< type and the parameters that differ from their defaults: "residual_ratio/control:average"
  std::string pointer;  ///< JSON pointer in the configuration file, for messages

  bool operator==(const Component& other) const { return type == other.type && values == other.values; }
};

/// A medium: one field, optionally times a spectrum; or one grey field per channel.
struct MediumSpec {
  Component field;             ///< type "channels" when `per_channel` is not empty
  std::vector<Real> spectrum;  ///< empty: grey
  std::vector<MediumSpec> per_channel;
  std::vector<Real> albedo;                ///< mu_s / mu, one for all channels or one each; empty: nothing scatters
  std::vector<MediumSpec> albedo_field;    ///< at most one: its extinction is the albedo, in space
  Real anisotropy = 0;                     ///< mean cosine of the Henyey-Greenstein phase function, in (-1, 1)
  std::vector<Real> emission;              ///< radiance, one for all channels or one each; empty: nothing is emitted
  std::vector<MediumSpec> emission_field;  ///< at most one, grey: scales the emission in space
  bool optional = false;                   ///< a missing data file skips the cells instead of failing the run
  std::string label;

  bool operator==(const MediumSpec& other) const {
    return field == other.field && spectrum == other.spectrum && per_channel == other.per_channel && albedo == other.albedo &&
           albedo_field == other.albedo_field && anisotropy == other.anisotropy && emission == other.emission &&
           emission_field == other.emission_field;
  }
};

/// An opaque black surface: it ends free paths, and emits.
struct SurfaceSpec {
  std::string type = "plane";       ///< "plane", "box" or "sphere"
  std::array<Real, 3> point{};      ///< on the plane; the box's low corner; the sphere's centre
  std::array<Real, 3> direction{};  ///< the plane's normal; the box's high corner
  Real radius = 1;
  std::vector<Real> radiance;  ///< one for all channels or one each; empty: 0

  bool operator==(const SurfaceSpec&) const = default;
};

/// The scene around the medium, and how paths are sampled (harness/kernel/path_kernel.h).
struct TransportSpec {
  std::vector<Real> environment;  ///< radiance, one for all channels or one each; empty: 0
  std::vector<SurfaceSpec> surfaces;
  std::string next_event = "off";        ///< "off", "phase", "uniform" or "mis"
  std::optional<int> roulette_from = 4;  ///< number of scatterings; absent: no roulette
  Real roulette_floor = 0.05;
  std::optional<int> most_scatterings{};  ///< absent: all light
  bool general = false;                   ///< use the kernel with all effects instead of that of the scene

  bool operator==(const TransportSpec&) const = default;
};

/// Applied to every sample, and to the reference, before it enters the statistics.
struct Measurement {
  bool clamp = false;     ///< to [0, 1]
  int quantise_bits = 0;  ///< 0: none; n: round to the nearest multiple of 1/(2^n - 1)

  bool operator==(const Measurement&) const = default;
};

/// When the laws of a cell's walks are tested: if its mean is undecidable, always, or never.
enum class LawPolicy { undecided, always, never };

/// Which bias is a FAIL: any proven bias, or only one proven beyond epsilon.
enum class Tolerate { nothing, epsilon };

/// What the verdict of a cell must prove, and what it may cost.
struct VerdictSpec {
  bool enabled = true;
  std::optional<Real> epsilon{};  ///< relative to the mean reference; absent: by the optical depth, see test_plan.cpp
  /// Drawn while the verdict is open; 0: samples_per_ray, and up to four times as many if the plan says that they suffice.
  std::uint64_t max_samples_per_ray = 0;
  std::optional<Real> max_lookups_per_ray{};  ///< expected lookups that all samples of a ray may cost
  Tolerate tolerate = Tolerate::nothing;
  bool all_samples = false;  ///< draw them while undecided, even if the plan says that they do not suffice
  LawPolicy laws = LawPolicy::undecided;

  bool operator==(const VerdictSpec&) const = default;
};

/// Error levels of a whole configuration.
struct ErrorRates {
  Real alpha = 1e-4;       ///< chance of even one false FAIL among all mean tests, and the same among all lookup tests
  Real alpha_pass = 1e-3;  ///< chance of a false PASS of one test

  bool operator==(const ErrorRates&) const = default;
};

/// A mean given by the configuration, for cells whose mean cannot be computed here.
struct GivenReference {
  std::vector<Real> value;  ///< one for all outputs or one each
  Real error = 0;           ///< relative bound on the error of the value
  std::string source;

  bool operator==(const GivenReference&) const = default;
};

/// One point of a sweep.  Indices refer to the plan's lists, which hold equal specifications once.
struct Cell {
  std::string id;    ///< hash of everything that decides the statistics
  std::string name;  ///< "estimator/medium/majorant", unique in the plan (experiment and seed are prefixed where needed)
  std::string experiment;
  Shared<Component> estimator;
  /// A second tracker, on streams of its own, whose samples are subtracted: the difference has the mean 0 where both are
  /// unbiased.
  std::optional<Shared<Component>> minus{};
  std::size_t medium = 0, majorant = 0, rays = 0;
  Quantity quantity = Quantity::transmittance;
  Precision precision = Precision::float64;
  bool lanes = true;  ///< walks may run side by side in registers, where the tracker can; the statistics are the same
  Measurement measurement;
  TransportSpec transport;
  std::uint64_t samples_per_ray = 1;
  std::optional<Real> equal_lookups{};  ///< lookups per ray: samples_per_ray becomes this over the expected lookups per sample
  std::uint64_t seed = 1;
  bool own_streams = false;  ///< streams depend on the estimator too, instead of common random numbers
  bool images = false;
  Real image_maximum = 1;  ///< value shown as white
  VerdictSpec verdict{};
  std::optional<GivenReference> reference{};
};

/// How wall time is measured: one thread, repetitions interleaved at random over all cells.
struct TimingPlan {
  bool enabled = true;
  int repetitions = 5;
  Real seconds = 0.02;  ///< minimum time of one repetition
  /// Samples that share one walk through the majorant structure, ascending.  The time of a cell is that of the last number; the
  /// others measure the cost of fewer samples.
  std::vector<std::uint64_t> samples_per_traversal{64};
};

/// A row of a published table beside the cells that answer it.
struct TableRow {
  std::string label;
  std::vector<std::pair<std::string, Real>> given;         ///< column heading, number from the source
  std::vector<std::pair<std::string, std::string>> cells;  ///< column heading, cell name
  std::optional<std::string> theory_of;                    ///< cell name whose theory column is shown
  std::optional<std::string> relative_to;                  ///< cell name; the row's metrics are divided by those of this cell
  std::string note;                                        ///< e.g. "not reproduced"
};
struct Table {
  std::string title, metric = "rmse";
  std::vector<TableRow> rows;
};

/// An expanded configuration, as plain data.
struct Plan {
  std::string name;
  std::vector<Shared<MediumSpec>> media;
  std::vector<Shared<Component>> majorants;
  std::vector<Shared<Component>> ray_sets;
  std::vector<Cell> cells;
  TimingPlan timing;
  ErrorRates error_rates;
  std::vector<Table> tables;
  std::vector<PublishedClaim> claims;
  std::map<std::string, std::string> credits;  ///< author and licence, by name of the data file
  std::string config_text;                     ///< the configuration as applied, JSON
};

}  // namespace nullmark
