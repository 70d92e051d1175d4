#include "harness/config/config.h"

#include "harness/io/json_input.h"
#include "harness/testing/fuzz/target.h"

namespace nullmark {

void fuzz_config(const std::string& input) {
  Plan plan;
  try {
    plan = read_config(input, "fuzz.json");
  } catch (const InputError&) {
    return;
  }
  // Results hold the configuration as applied; it must be one, and the same.
  if (read_config(plan.config_text, "applied.json").config_text != plan.config_text) __builtin_trap();
}

}  // namespace nullmark
