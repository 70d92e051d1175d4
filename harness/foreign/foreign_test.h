#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "harness/config/config.h"
#include "harness/foreign/consent.h"
#include "harness/io/json_input.h"
#include "harness/testing/run_untimed.h"

/// Trackers from outside as configurations name them, and runs of them, for tests.
namespace nullmark::foreign_test {

inline std::string library(const std::string& file, const std::string& name, const std::string& more = "") {
  return fmt::format(R"({{"type":"library","file":"{}","name":"{}"{}{}}})", file, name, more.empty() ? "" : ",", more);
}

inline std::string process(const std::vector<std::string>& command, const std::string& more = "") {
  return fmt::format(R"({{"type":"process","command":{}{}{}}})", Json(command).dump(), more.empty() ? "" : ",", more);
}

/// Runs one experiment of a ray along x with the streams that all trackers share.
inline std::vector<CellRecord> run(const std::string& estimators, const std::string& media, const std::string& bounds,
                                   int threads = 0, int samples = 4096, const std::string& more = "") {
  allow_foreign_code();
  const std::string text = fmt::format(
      R"({{"nullmark":"config/2","name":"t","timing":{{"enabled":false}},"experiments":[{{"name":"e","rays":"single","samples_per_ray":{},"verdict":{{"max_samples_per_ray":4000000}},{}"matrix":{{"estimator":{},"medium":{},"majorant":{}}}}}]}})",
      samples, more.empty() ? "" : more + ",", estimators, media, bounds);
  return run_untimed(read_config(text, "t.json"), {}, threads);
}

}  // namespace nullmark::foreign_test
