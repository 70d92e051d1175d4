#include "harness/run/merge.h"

#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/testing/fuzz/target.h"

namespace nullmark {

void fuzz_merge(const std::string& input) {
  // Parts stand one after another, each but the first behind a line of its own.
  static const std::string kNext = "\n--- part\n";
  std::vector<RunRecord> parts;
  std::vector<std::string> names;
  try {
    for (std::size_t begin = 0; begin <= input.size();) {
      const std::size_t end = std::min(input.find(kNext, begin), input.size());
      names.push_back("part " + std::to_string(names.size() + 1));
      parts.push_back(read_results(input.substr(begin, end - begin), names.back()));
      begin = end + kNext.size();
    }
    const RunRecord merged = merge_results(parts, names);
    const std::string text = results_text(merged);
    if (results_text(read_results(text, "merged")) != text) __builtin_trap();
  } catch (const InputError&) {
  }
}

}  // namespace nullmark
