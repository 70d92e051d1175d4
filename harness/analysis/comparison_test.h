#pragma once

#include <cmath>
#include <string>

#include "harness/model/record.h"

/// Cells to be ranked, for tests.
namespace nullmark::comparison_test {

/// A cell of one ray with 100 samples: reference .5, variance .04, 10 ns a sample.
inline CellRecord cell(const std::string& estimator, Real variance = 0.04, Real ns = 10) {
  CellRecord record;
  record.cell.estimator = Component{estimator, {}, estimator, ""};
  record.cell.samples_per_ray = 100;
  record.claims = "unbiased";
  record.status = Status::ok;
  record.rays = 1;
  record.samples = 100;
  record.lookups_per_sample = 2;
  ChannelRecord channel;
  channel.reference = channel.reference_rms = 0.5;
  channel.variance_theory = variance;
  record.channel = {channel};
  record.time = TimeRecord{};
  record.time->repetition_ns = {ns * 0.99, ns, ns * 1.01};
  return record;
}

inline CellRecord marching(Real floor, Real variance = 0, Real ns = 20) {
  CellRecord record = cell("ray_marching", variance, ns);
  record.claims = "consistent";
  record.channel[0].rmse = std::sqrt(floor * floor * 0.25 + variance / 100);
  return record;
}

/// A tracker that claims to be unbiased, is twice as fast, and whose verdict says otherwise; its floor is that of `floor`.
inline CellRecord disproven(const char* name, Outcome outcome, Real floor) {
  CellRecord record = cell(name, 0.04, 5);
  record.channel[0].rmse = std::sqrt(floor * floor * 0.25 + 0.04 / 100);
  record.verdict.emplace();
  record.verdict->against = "reference";
  record.verdict->unbiased = outcome;
  record.verdict->violated = outcome == Outcome::violated;
  return record;
}

}  // namespace nullmark::comparison_test
