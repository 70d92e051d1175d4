#include <fmt/format.h>

#include "harness/io/component_fields.h"
#include "harness/io/results_json.h"
#include "harness/io/verdict_json.h"
#include "harness/model/cost.h"
#include "harness/model/metrics.h"

namespace nullmark {
namespace {

Json reals_schema() { return {{"type", {"number", "array", "null"}}, {"items", {{"type", {"number", "null"}}}}}; }

Json reals_json(const std::vector<std::optional<Real>>& values, int outputs) {
  if (outputs == 1) return values.empty() ? Json(nullptr) : number_or_null(values[0]);
  Json list = Json::array();
  for (const std::optional<Real>& value : values) list.push_back(number_or_null(value));
  return list.empty() ? Json(nullptr) : list;
}

/// The inverse, for a sampled cell.
std::vector<std::optional<Real>> read_reals(const JsonNode& node, int outputs) {
  const auto size = static_cast<std::size_t>(outputs);
  const auto one = [](const JsonNode& number) { return number.json().is_null() ? std::nullopt : std::optional(number.number()); };
  if (node.json().is_null()) return std::vector<std::optional<Real>>(size);
  if (outputs == 1) return {one(node)};
  if (!node.json().is_array() || node.json().size() != size) node.expected(fmt::format("a list of {} numbers", outputs));
  std::vector<std::optional<Real>> values;
  for (const JsonNode& element : node.elements()) values.push_back(one(element));
  return values;
}

/// A member of all channels: a number, or a list of one per output where there are several; null where the cell was not sampled.
template <class Channel>
struct ChannelsField {
  const CellRecord& record;
  std::vector<Channel>& channels;
  std::optional<Real> Channel::*member;

  Json json() const {
    std::vector<std::optional<Real>> values;
    for (const Channel& channel : channels) values.push_back(channel.*member);
    return reals_json(values, outputs_of(record));
  }
  void read(const JsonNode& node) const {
    if (record.samples == 0) return;
    const std::vector<std::optional<Real>> values = read_reals(node, outputs_of(record));
    channels.resize(values.size());
    for (std::size_t c = 0; c < values.size(); ++c) channels[c].*member = values[c];
  }
  Json schema() const { return reals_schema(); }
};

/// A figure that is computed of each channel.
struct DerivedReals {
  std::vector<std::optional<Real>> values;
  int outputs = 1;

  Json json() const { return reals_json(values, outputs); }
  Json schema() const { return reals_schema(); }
  bool empty() const { return values.empty(); }
};

DerivedReals each_channel(const CellRecord& record, std::optional<Real> figure(const CellRecord&, std::size_t)) {
  DerivedReals reals{{}, outputs_of(record)};
  for (std::size_t c = 0; c < record.channel.size(); ++c) reals.values.push_back(figure(record, c));
  return reals;
}

template <class Visit>
void visit_time(Visit& visit, TimeRecord& time, const CellRecord& record) {
  visit.required("ns_per_sample", time.ns_per_sample);
  visit.required("ns_per_lookup", time.ns_per_lookup);
  visit.lenient("floor_ratio", time.floor_ratio, "ns_per_lookup over the cheapest possible step");
  visit.sparse("memory_ratio", NullMeansField{time.memory_ratio, 0},
               "of volumes: ns_per_lookup over one read of a random cache line");
  visit.lenient("loop_ratio", time.loop_ratio, "ns_per_lookup over a plain ratio loop on a constant medium");
  visit.required("repetitions", time.repetitions);
  visit.lenient("mad", time.mad, "median absolute deviation of ns_per_sample");
  visit.sparse("seam_ns_per_sample", NullMeansField{time.seam_ns_per_sample, 0},
               "part of ns_per_sample that exchanges with the tracker's process cost");
  visit.lenient("waiting", time.waiting, "share of the wall time in which the timed thread did not run");
  visit.required("threads", time.threads);
  visit.derived("traversal_included", [] { return true; });
  visit.lenient("samples_per_traversal", time.samples_per_traversal);
  visit.list("batches", time.batches, [](auto& inner, auto& batch) {
    inner.required("samples_per_traversal", AtLeastField{batch.samples_per_traversal, 1});
    inner.required("ns_per_sample", batch.ns_per_sample);
    inner.required("mad", batch.mad);
  });
  visit.lenient("repetition_ns", time.repetition_ns, "ns_per_sample of each repetition");
  visit.lenient("majorant_build_seconds", time.majorant_build_seconds);
  visit.derived("variance_x_ns", [&] { return each_channel(record, variance_x_ns); });
  visit.derived("seconds_to_1pct", [&]() -> std::optional<Real> {
    const std::optional<Cost> cost = cost_of(record);
    const std::optional<Interval> seconds = cost ? seconds_to(*cost, 0.01) : std::nullopt;
    return seconds ? std::optional(seconds->value) : std::nullopt;
  });
}

struct TransportField {
  TransportSpec& value;

  Json json() const { return transport_json(value); }
  void read(const JsonNode& node) const { value = read_transport(node); }
  Json schema() const { return transport_schema(); }
};

/// Evidence; null where nothing was tested.
struct VerdictField {
  std::optional<VerdictRecord>& value;

  Json json() const { return value ? verdict_json(*value) : Json(nullptr); }
  void read(const JsonNode& node) const {
    if (!node.json().is_null()) value = read_verdict(node);
  }
  Json schema() const { return verdict_schema(); }
};

/// What the cell is.
template <class Visit>
void visit_cell(Visit& visit, CellRecord& record) {
  auto& cell = record.cell;
  visit.required("id", cell.id, "hash of everything that determines the statistics, 16 hexadecimal digits");
  visit.required("name", cell.name);
  visit.required("experiment", cell.experiment);
  visit.part("estimator", [&](auto& inner) {
    Component estimator = *cell.estimator;
    visit_component(inner, estimator, ComponentKind::estimator, estimator.label);
    if constexpr (Visit::kReads) cell.estimator = std::move(estimator);
    inner.required("claims", record.claims);
    inner.required("range", record.range);
    inner.sparse("order", record.order, "of a consistent estimator's bias in its step");
    inner.sparse("tracker", record.tracker.name, "what a tracker from outside of nullmark calls itself");
    inner.sparse("version", record.tracker.version, "of that tracker, as it says");
    inner.sparse("hash", record.tracker.hash, "of its library, or of its command and the files that it names");
    inner.sparse("lookups_told", record.tracker.lookups_told, "lookups are what the tracker tells, not counted");
    inner.sparse("unrepeatable", record.tracker.unrepeatable, "its samples cannot be drawn again");
    inner.sparse("given_depth", record.given_depth, "the estimator is handed the exact optical depth");
  });
  visit.sparse("minus", OptionalEstimatorField{cell.minus}, "a second tracker, whose samples are subtracted");
  visit.part("medium", [&](auto& inner) {
    MediumSpec medium = *record.medium;
    visit_fields(inner, medium);
    if constexpr (Visit::kReads) record.medium = std::move(medium);
    inner.lenient("hash", record.medium_hash);
  });
  visit.part("majorant", [&](auto& inner) {
    Component majorant = *record.majorant;
    visit_component(inner, majorant, ComponentKind::majorant, majorant.label);
    if constexpr (Visit::kReads) record.majorant = std::move(majorant);
    bool built = record.structure.has_value();
    StructureSize size = record.structure.value_or(StructureSize{});
    inner.when("cells", built, size.cells, "regions with their own bounds");
    inner.when("nodes", built, size.nodes, "of a tree, leaves included; 0: no tree");
    inner.when("bytes", built, size.bytes, "of memory");
    if constexpr (Visit::kReads)
      if (built) record.structure = size;
  });
  Component ray_set = *record.ray_set;
  visit.required("ray_set", ComponentField{ray_set, ComponentKind::ray_set});
  if constexpr (Visit::kReads) record.ray_set = std::move(ray_set);
  visit.required("quantity", cell.quantity);
  visit.lenient("precision", cell.precision);
  visit.sparse("in_lanes", record.in_lanes, "walks ran side by side in registers");
  if (Visit::kReads || Visit::kDescribes || !cell.lanes)
    visit.lenient("lanes", cell.lanes, "false where the configuration forbids it");
  visit.part("measurement", [&](auto& inner) { visit_fields(inner, cell.measurement); });
  visit.lenient("transport", TransportField{cell.transport});
  visit.required("channels", WithinField{record.channels, 1, kMaxChannels});
  visit.lenient("outputs", record.outputs, "names of the entries of the statistics, if they are not channels");
  visit.required("effects", record.effects);
  visit.required("rays", record.rays);
  visit.required("samples_per_ray", cell.samples_per_ray);
  visit.sparse("equal_lookups", cell.equal_lookups);
  visit.required("samples", record.samples, "over all rays");
  visit.required("seed", cell.seed);
  visit.required("own_streams", cell.own_streams);
}

/// What was measured and found.
template <class Visit>
void visit_findings(Visit& visit, CellRecord& record) {
  const auto statistic = [&](std::optional<Real> ChannelRecord::*member) {
    return ChannelsField<ChannelRecord>{record, record.channel, member};
  };
  visit.required("status", record.status);
  visit.sparse("reason", record.reason);
  visit.sparse("part", record.part, "of a cell that shards share: which part of its samples is drawn");
  visit.sparse("drawn_parts", record.drawn_parts,
               "the statistics of these samples, packed; `merge` and `run --resume` read them");
  visit.sparse("build", record.build, "compiler, C library and instruction set of the cell, where not those of the provenance");
  visit.sparse("reliance", record.reliance,
               "of an estimator that is handed the exact optical depth: how much of its answer follows that depth, 1 all of it");
  visit.required("mean", statistic(&ChannelRecord::mean), "average over the rays");
  visit.part("reference", [&](auto& inner) {
    inner.required("value", statistic(&ChannelRecord::reference), "average over the rays");
    inner.required("error", statistic(&ChannelRecord::reference_error), "bound on the reference's own error");
    inner.lenient("rms", statistic(&ChannelRecord::reference_rms), "root mean square over the rays");
    inner.required("method", record.reference_method);
  });
  visit.required("bias", statistic(&ChannelRecord::bias), "mean - reference");
  visit.lenient("bias_theory", statistic(&ChannelRecord::bias_theory), "mean that the estimator predicts - reference");
  visit.required("rmse", statistic(&ChannelRecord::rmse), "root mean square error of the rays' means");
  visit.lenient("rmse_theory", statistic(&ChannelRecord::rmse_theory), "what theory predicts for rmse");
  visit.required("variance", statistic(&ChannelRecord::variance), "per sample, averaged over the rays");
  visit.lenient("variance_theory", statistic(&ChannelRecord::variance_theory), "what theory predicts for variance");
  visit.lenient("variance_basis", record.variance_basis, "analytic, sample, or empty");
  visit.lenient("relative_variance", statistic(&ChannelRecord::relative_variance),
                "variance, analytic where known, over the mean square of the reference");
  visit.lenient("kurtosis", statistic(&ChannelRecord::kurtosis), "of the errors around the reference, pooled");
  visit.lenient("lookups_per_sample", record.lookups_per_sample);
  visit.lenient("lookups_theory", record.lookups_theory);
  visit.lenient("null_collisions_per_sample", record.null_collisions_per_sample);
  visit.lenient("rng_draws_per_sample", record.draws_per_sample);
  visit.lenient("lookups", record.lookups, "over all samples");
  visit.lenient("rng_draws", record.draws, "over all samples");
  visit.lenient("lookups_variance", record.lookups_variance, "of one sample's lookups, averaged over the rays");
  visit.lenient("squared_error_blocks", record.squared_error_blocks,
                "mean squared error of 16 disjoint parts of the samples, cut alike for all estimators; averaged over channels");
  visit.lenient("majorant_violations", record.majorant_violations);
  visit.lenient("largest_violation", record.largest_violation, "extinction over majorant, where above 1");
  visit.lenient("largest_sample", record.largest_sample, "greatest absolute value of a finite sample, before any measurement");
  visit.lenient("nonfinite", record.nonfinite);
  visit.lenient("verdict", VerdictField{record.verdict}, "evidence for and against the claims; see harness/verdict/verdict.md");
}

}  // namespace

template <class Visit>
void visit_fields(Visit& visit, CellRecord& record) {
  visit_cell(visit, record);
  visit_findings(visit, record);
  visit.optional_part("time", record.time, [&](auto& inner, auto& time) { visit_time(inner, time, record); });
  visit.part("efficiency", [&](auto& inner) {
    inner.derived(
        "variance_x_lookups", [&] { return each_channel(record, variance_x_lookups); }, "lower is better");
  });
  visit.list("convergence", record.convergence, [&](auto& inner, auto& step) {
    inner.required("samples", step.samples);
    using Error = ConvergenceRecord::Error;
    inner.required("rmse", ChannelsField<Error>{record, step.channel, &Error::rmse}, "of means of so many samples");
    inner.required("variance", ChannelsField<Error>{record, step.channel, &Error::variance}, "of means of so many samples");
  });
  visit.lenient("image_maximum", record.cell.image_maximum);
  visit.sparse("instructions", record.instructions, "instructions of drawing all samples, counted in a simulator");
  visit.sparse("last_level_misses", record.last_level_misses, "of data, in the same simulator's caches");
  visit.when("images", record.cell.images, record.images);
}

Json cell_json(const CellRecord& record) { return fields_json(record); }

CellRecord read_cell(const JsonNode& node) {
  CellRecord record;
  record.effects.clear();
  read_fields(node, record);
  return record;
}

Json cell_schema() { return fields_schema<CellRecord>(false); }

}  // namespace nullmark
