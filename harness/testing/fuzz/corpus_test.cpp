// What fuzzers found, and a seed of each kind, over again: corpus/TARGET holds one input a file.  A crash, a hang or a broken
// promise ends the tests.

#include <gtest/gtest.h>

#include <filesystem>

#include "harness/io/file_io.h"
#include "harness/testing/fuzz/target.h"

namespace nullmark {
namespace {

void replay(const char* target, void (*fuzz)(const std::string&)) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(NULLMARK_SOURCE_DIR "/harness/testing/fuzz/corpus") / target)) {
    SCOPED_TRACE(entry.path().filename());
    EXPECT_NO_THROW(fuzz(read_file(entry.path().string())));
    ++files;
  }
  EXPECT_GT(files, 0);
}

TEST(Corpus, Config) { replay("config", fuzz_config); }
TEST(Corpus, Results) { replay("results", fuzz_results); }
TEST(Corpus, Merge) { replay("merge", fuzz_merge); }
TEST(Corpus, FlatVolume) { replay("flat_volume", fuzz_flat_volume); }
TEST(Corpus, Frames) { replay("frames", fuzz_frames); }
// Intact seeds alone: what damaged files do to OpenVDB is contained, not mended.
TEST(Corpus, Vdb) { replay("vdb", fuzz_vdb); }

}  // namespace
}  // namespace nullmark
