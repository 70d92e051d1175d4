#pragma once

#include <map>
#include <string>

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

/// The pictures of a report, each once, as 16-bit numbers in base64 (harness/report/report.md).
class ReportImages {
 public:
  /// The pictures of a cell as indices into json(), by kind ("mean", "reference", "variance", "variance_theory", "lookups",
  /// "null_collisions"); null if it has none or they are not beside the results file.  Channels are averaged.
  Json add(const CellRecord& record, const std::string& results_file);

  const Json& json() const { return images_; }

  /// Pictures of a results file that could not be read: the expected folder, and the reason.
  struct Missing {
    std::string folder, reason;
  };
  const std::map<std::string, Missing>& missing() const { return missing_; }

 private:
  Json images_ = Json::array();
  std::map<std::string, std::size_t> places_;  ///< by content
  std::map<std::string, Missing> missing_;
};

}  // namespace nullmark
