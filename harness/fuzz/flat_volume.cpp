#include "media/flat_volume.h"

#include "harness/fuzz/target.h"
#include "media/parameters.h"

namespace nullmark {

void fuzz_flat_volume(const std::string& input) {
  try {
    const VolumeData data = unflatten(std::as_bytes(std::span(input)), "fuzz.vdb", "density");
    const RangeSummary all = data.values.summary(data.active);
    if (!(all.minimum >= 0) || !std::isfinite(all.maximum)) __builtin_trap();
  } catch (const ParameterError&) {
  }
}

}  // namespace nullmark
