#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "harness/config/config.h"
#include "harness/model/record.h"

namespace nullmark {

/// Two estimators in a grey and in a chromatic medium, and a table, for tests of what is done with results.
inline Plan example_plan() {
  return read_config(
      R"({"nullmark":"config/2","name":"example","experiments":[{"name":"e","rays":"single","samples_per_ray":10,
    "matrix":{"estimator":["ratio",{"type":"residual_ratio","control":"average"}],
              "medium":["linear",{"type":"layers","values":[1,2,3],"lo":[-1,0,0],"spectrum":[1,2,4]}]}}],
    "tables":[{"title":"T","rows":[{"label":"R","given":{"paper":0.1},"note":"not reproduced",
               "cells":{"here":{"estimator":"ratio","medium":"linear"}},"theory":{"estimator":"ratio","medium":"linear"}}]}],
    "claims":[{"id":"C","source":"S","claim":"so it is","note":"nearly","parts":[
      {"says":"a","metric":"variance","cells":{"estimator":"ratio"},"at_most":{"estimator":"residual_ratio"},"factor":2},
      {"metric":"mean","cells":[{"medium":"linear"}],"near":[1,2],"tolerance":0.1},
      {"metric":"lookups_per_sample","cells":{"estimator":"ratio"},"at_least":"theory"},
      {"cells":{"medium":"linear"},"unbiased":true},
      {"metric":"rmse","cells":{},"slope_against":"samples_per_ray","near":-0.5,"tolerance":0.1}]},
      {"id":"D","source":"theory","claim":"so it must be","required":true,"parts":[
      {"metric":"samples_per_ray","cells":{"estimator":"ratio","medium":"linear"},"near":10,"tolerance":0.1}]}]})",
      "example.json");
}

/// Gives figures that others determine the values that these say.
inline void make_consistent(CellRecord& record) {
  const auto n = static_cast<Real>(record.cell.samples_per_ray);
  for (std::size_t c = 0; c < record.channel.size(); ++c) {
    ChannelRecord& channel = record.channel[c];
    channel.bias = *channel.mean - *channel.reference;
    channel.rmse = std::abs(*channel.bias) * 1.1;
    channel.relative_variance = *channel.variance_theory / *channel.reference_rms / *channel.reference_rms;
    if (channel.kurtosis) channel.kurtosis = 3 + 1. / 3;
    record.convergence[0].channel[c].rmse = std::sqrt(*channel.variance * (n - 1) / n + *channel.rmse * *channel.rmse);
  }
}

/// Results with numbers that only a round trip bit for bit brings back.
inline RunRecord example_results(const Plan& plan = example_plan()) {
  RunRecord run;
  run.name = plan.name;
  run.config_text = plan.config_text;
  run.tables = plan.tables;
  run.claims = plan.claims;
  run.provenance = {{"start", "\"2026-01-02T03:04:05Z\""}, {"cpu", R"({"model":"x","cores":8})"}};
  Real number = 0.1;
  const auto next = [&] { return number = number * 1.7 + 1e-17; };
  for (const Cell& cell : plan.cells) {
    CellRecord record;
    record.cell = cell;
    record.medium = plan.media[cell.medium];
    record.majorant = plan.majorants[cell.majorant];
    record.ray_set = plan.ray_sets[cell.rays];
    record.medium_hash = "0123456789abcdef";
    record.structure = StructureSize{7, 13, 9007199254740993};
    record.claims = "unbiased";
    record.range = "unit";
    record.channels = record.medium->spectrum.empty() ? 1 : 3;
    record.status = Status::ok;
    record.rays = 1;
    record.samples = 10;
    record.reference_method = "closed_form";
    record.variance_basis = "analytic";
    for (int c = 0; c < record.channels; ++c)
      record.channel.push_back({next(), next(), next(), -next(), next(), next(), next(), next(), next(), next(), next(), next()});
    record.channel[0].kurtosis.reset();
    record.lookups_theory = 5e-324;
    record.null_collisions_per_sample = 5e-324;
    record.lookups = 9007199254740993;
    record.draws = 9223372036854775807;
    record.lookups_per_sample = static_cast<Real>(record.lookups) / 10;
    record.draws_per_sample = static_cast<Real>(record.draws) / 10;
    record.lookups_variance = 1. / 3;
    record.instructions = 9007199254740993;
    record.last_level_misses = 9007199254740991;
    record.majorant_violations = 3;
    record.largest_violation = 1 + 2.220446049250313e-16;
    record.time = TimeRecord{next(), next(), next(), next(), next(), 2, 1, 64, {next(), next()}, next()};
    record.time->waiting = 1. / 3;
    record.time->batches = {{1, next(), next()}, {64, record.time->ns_per_sample, record.time->mad}};
    record.squared_error_blocks = {next(), next()};
    for (const std::uint64_t samples : {std::uint64_t{1}, std::uint64_t{2}}) {
      ConvergenceRecord step{samples, {}};
      for (int c = 0; c < record.channels; ++c) {
        step.channel.emplace_back().rmse = next();
        if (c != 1) step.channel.back().variance = next();
      }
      record.convergence.push_back(step);
    }
    make_consistent(record);
    run.cells.push_back(record);
  }
  return run;
}

/// A cell that was never sampled.
inline CellRecord unsampled(const CellRecord& record, Status status, const std::string& reason) {
  CellRecord bare;
  bare.cell = record.cell;
  bare.medium = record.medium;
  bare.majorant = record.majorant;
  bare.ray_set = record.ray_set;
  bare.claims = record.claims;
  bare.range = record.range;
  bare.channels = record.channels;
  bare.status = status;
  bare.reason = reason;
  return bare;
}

}  // namespace nullmark
