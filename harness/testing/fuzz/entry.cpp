#include "harness/testing/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  nullmark::NULLMARK_FUZZ_TARGET(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
