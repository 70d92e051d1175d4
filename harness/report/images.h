#pragma once

#include <map>
#include <string>

#include "harness/json_input.h"
#include "harness/record.h"

namespace nullmark {

/// The pictures of a report, each once, as 16-bit numbers in base64 (harness/report/report.md).
class ReportImages {
 public:
  /// The pictures of a cell, by kind ("mean", "reference", "variance", "lookups", "null_collisions"), as places in json(); null
  /// where it has none or they are not beside the results file.  Channels are averaged.
  Json add(const CellRecord& record, const std::string& results_file);

  const Json& json() const { return images_; }

  /// Results whose pictures could not be read, with the reason.
  const std::map<std::string, std::string>& missing() const { return missing_; }

 private:
  Json images_ = Json::array();
  std::map<std::string, std::size_t> places_;  ///< by content
  std::map<std::string, std::string> missing_;
};

}  // namespace nullmark
