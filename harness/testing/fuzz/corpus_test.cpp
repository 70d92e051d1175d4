// What fuzzers found, and a seed of each kind, over again: corpus/TARGET holds one input a file.  A crash, a hang or a broken
// promise ends the tests.

#include <gtest/gtest.h>

#include <filesystem>

#include "harness/config/config.h"
#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/run/merge.h"
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

std::string seed(const std::string& name) {
  return read_file((std::filesystem::path(NULLMARK_SOURCE_DIR "/harness/testing/fuzz/corpus") / name).string());
}

/// From seeds that are refused at once a fuzzer does not find its way in.
TEST(Corpus, SeedsAreOfThisVersion) {
  for (const char* name : {"config/many_keys.json", "config/radiance.json"})
    EXPECT_NO_THROW(read_config(seed(name), name)) << "write it in the keys of this version";
  for (const char* name : {"results/cell.json", "results/grey.json"})
    EXPECT_NO_THROW(read_results(seed(name), name)) << "run its configuration (jq .config) again";
  const std::string shards = seed("merge/shards"), next = "\n--- part\n";
  const std::size_t at = shards.find(next);
  ASSERT_NE(at, std::string::npos);
  std::vector<RunRecord> parts = {read_results(shards.substr(0, at), "1"), read_results(shards.substr(at + next.size()), "2")};
  EXPECT_EQ(merge_results(parts, {"1", "2"}).cells.size(), parts[0].cells.size() + parts[1].cells.size());
}

}  // namespace
}  // namespace nullmark
