#include "harness/fuzz/target.h"
#include "harness/json_input.h"
#include "harness/results_json.h"
#include "harness/summary.h"
#include "harness/table.h"

namespace nullmark {

void fuzz_results(const std::string& input) {
  RunRecord run;
  try {
    run = read_results(input, "fuzz.json");
  } catch (const InputError&) {
    return;
  }
  // What could be read can be written, and comes back bit for bit.
  const std::string text = results_text(run);
  if (results_text(read_results(text, "again.json")) != text) __builtin_trap();
  results_tables(run);
  try {
    const Summary summary = summarise(run);
    summary_text(run, summary);
    summary_markdown(run, summary, "fuzz.json");
  } catch (const InputError&) {
    // The configuration inside may be anything.
  }
}

}  // namespace nullmark
