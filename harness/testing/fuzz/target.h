#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace nullmark {

/// What a fuzzer does with one input, and what the regression tests do with each file of the corpus.  Input that is refused in
/// the way that users are told of is fine; any other exception, and any promise broken, ends the process.
void fuzz_config(const std::string& input);
void fuzz_results(const std::string& input);
void fuzz_merge(const std::string& input);
void fuzz_flat_volume(const std::string& input);
/// Frames of a tracker's process: its welcome, a ray, or requests and a result.
void fuzz_frames(const std::string& input);
/// OpenVDB's own reader, in this process: what it finds is contained by read_vdb, not mended.
void fuzz_vdb(const std::string& input);

}  // namespace nullmark
