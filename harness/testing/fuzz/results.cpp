#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/report/check_text.h"
#include "harness/report/results_tables.h"
#include "harness/testing/fuzz/target.h"

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
