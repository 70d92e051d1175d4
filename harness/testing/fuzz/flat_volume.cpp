#include "media/volumes/flat_volume.h"

#include "harness/testing/fuzz/target.h"
#include "media/base/parameters.h"

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
