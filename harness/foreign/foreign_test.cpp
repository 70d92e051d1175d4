#include "harness/foreign/foreign_test.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "harness/config/config.h"
#include "harness/foreign/consent.h"
#include "harness/io/json_input.h"
#include "harness/model/names.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using foreign_test::library;
using foreign_test::process;
using foreign_test::run;

std::string word(const CellRecord& record) { return verdict_word(kind_of(record)); }
std::string finding(const CellRecord& record) { return fmt::format("{}: {}", word(record), finding_of(record)); }

/// The error that ends the only cell of an estimator; "ok" where none does.
std::string failure(const std::string& estimator) {
  const CellRecord record = run(estimator, R"({"type":"homogeneous","extinction":1})", R"(["global"])").at(0);
  return record.status == Status::ok ? "ok" : record.reason;
}

std::string refusal(const std::string& estimator) {
  try {
    run(estimator, R"("linear")", R"(["global"])");
  } catch (const ParameterError& error) {
    return error.parameter + ": " + error.what();
  }
  return "accepted";
}

void expect_same(const std::vector<CellRecord>& a, const std::vector<CellRecord>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(a[i].cell.name);
    ASSERT_EQ(a[i].status, Status::ok) << a[i].reason;
    ASSERT_EQ(b[i].status, Status::ok) << b[i].reason;
    EXPECT_EQ(a[i].lookups, b[i].lookups);
    EXPECT_EQ(a[i].draws, b[i].draws);
    EXPECT_EQ(a[i].majorant_violations, b[i].majorant_violations);
    EXPECT_EQ(a[i].largest_violation, b[i].largest_violation);
    ASSERT_EQ(a[i].channel.size(), b[i].channel.size());
    for (std::size_t c = 0; c < a[i].channel.size(); ++c) {
      EXPECT_EQ(a[i].channel[c].mean, b[i].channel[c].mean);
      EXPECT_EQ(a[i].channel[c].variance, b[i].channel[c].variance);
    }
  }
}

constexpr const char* kMedia =
    R"([{"type":"linear","begin":0.2,"end":2},{"type":"fractal_noise","peak":3},{"type":"linear","spectrum":[1,2,0.5]}])";
constexpr const char* kBounds =
    R"(["global",{"type":"global","looseness":2},{"type":"grid","resolution":4},{"type":"grid","resolution":4,"crossing":"rewind"}])";

/// Along one bound and along several, or a tracker that needs one could pass without it.
TEST(Foreign, ViolationsAreCountedAsOfTheBuiltIn) {
  constexpr const char* kTooLow = R"([{"type":"global","looseness":0.5},{"type":"grid","resolution":4,"looseness":0.5}])";
  const auto built_in = run(R"("ratio")", kMedia, kTooLow);
  for (const CellRecord& record : built_in) EXPECT_GT(record.majorant_violations, 0u) << record.cell.name;
  expect_same(built_in, run(library(NULLMARK_EXAMPLE_LIBRARY, "ratio"), kMedia, kTooLow));
}

TEST(Foreign, RatioInCHasTheBitsOfTheBuiltIn) {
  const auto built_in = run(R"("ratio")", kMedia, kBounds);
  expect_same(built_in, run(library(NULLMARK_EXAMPLE_LIBRARY, "ratio"), kMedia, kBounds, 1));
  expect_same(built_in, run(library(NULLMARK_EXAMPLE_LIBRARY, "ratio"), kMedia, kBounds, 2));
  expect_same(built_in, run(library(NULLMARK_EXAMPLE_LIBRARY, "ratio", R"("isolate":true)"), kMedia, kBounds));
  expect_same(built_in, run(library(NULLMARK_TRACKERS_LIBRARY, "ratio"), kMedia, kBounds));
}

TEST(Foreign, RightTrackersPassAndASlipFails) {
  std::vector<std::pair<std::string, std::string>> trackers = {
      {library(NULLMARK_TRACKERS_LIBRARY, "ratio"), "PASS"},
      {library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"points"})"), "PASS"},
      {library(NULLMARK_TRACKERS_LIBRARY, "delta"), "PASS"},
      {library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"slip"})"), "FAIL"},
      {library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("isolate":true,"parameters":{"fault":"slip"})"), "FAIL"}};
  for (const auto& [tracker, expected] : trackers)
    for (const CellRecord& record : run(tracker, R"([{"type":"linear","begin":0.5,"end":2}])", kBounds, 0, 65536))
      EXPECT_EQ(word(record), expected) << tracker << ": " << finding(record);
}

TEST(Foreign, FreePathsAreJudged) {
  const std::string more = R"("quantity":"free_path")";
  for (const CellRecord& record :
       run(library(NULLMARK_TRACKERS_LIBRARY, "delta"),
           R"([{"type":"linear","begin":0.5,"end":2},{"type":"linear","begin":0.5,"end":2,"albedo":0.6}])",
           R"(["global",{"type":"grid","resolution":4}])", 0, 65536, more)) {
    EXPECT_EQ(word(record), "PASS") << finding(record);
    EXPECT_EQ(record.channel.size(), record.medium->albedo.empty() ? 10u : 11u);
  }
  const auto faulty = run(library(NULLMARK_TRACKERS_LIBRARY, "delta", R"("parameters":{"fault":"event"})"), R"("linear")",
                          R"(["global"])", 0, 1024, more);
  EXPECT_NE(faulty.at(0).reason.find("event 9; expected 0 to 3"), std::string::npos) << faulty[0].reason;
}

TEST(Foreign, StatedTheoryIsUsedAndTested) {
  const auto records = run(library(NULLMARK_TRACKERS_LIBRARY, "ratio_with_theory"), R"({"type":"homogeneous","extinction":1})",
                           R"([{"type":"global","looseness":2}])", 0, 65536);
  EXPECT_EQ(word(records.at(0)), "PASS") << finding(records[0]);
  const auto built_in = run(R"("ratio")", R"({"type":"homogeneous","extinction":1})", R"([{"type":"global","looseness":2}])");
  EXPECT_NEAR(*records[0].channel[0].variance_theory, *built_in[0].channel[0].variance_theory, 1e-15);
  EXPECT_NEAR(*records[0].lookups_theory, 2, 1e-12);
}

TEST(Foreign, LookupsOfAMediumOfItsOwnAreMarkedAsTold) {
  const auto records =
      run(library(NULLMARK_TRACKERS_LIBRARY, "own"), R"({"type":"homogeneous","extinction":1})", R"(["global"])", 0, 65536);
  EXPECT_EQ(word(records.at(0)), "PASS") << finding(records[0]);
  EXPECT_TRUE(records[0].tracker.lookups_told);
  EXPECT_EQ(records[0].lookups_per_sample, 3);
  EXPECT_EQ(records[0].tracker.version, "7");
  EXPECT_EQ(records[0].tracker.hash.size(), 16u);
}

TEST(Foreign, FaultsOfALibraryEndTheirCell) {
  const std::map<std::string, std::string> faults = {{"throws", "threw across the C interface in sample: as C++ does"},
                                                     {"rounds", "left the thread's rounding mode"},
                                                     {"index", "names sample 1048576 of a call; expected 0 to "},
                                                     {"outside", "looks up distance 2 of ray 0; expected 0 to 1"},
                                                     {"negative", "asks for -1 numbers"},
                                                     {"unset", "samples are not finite"},
                                                     {"nan", "samples are not finite"},
                                                     {"stops", "ends with 2 though nothing told it to stop"},
                                                     {"describe", "the tracker describes its range as 9"},
                                                     {"fails", "the tracker failed: out of luck"}};
  for (const auto& [fault, said] : faults)
    for (const char* isolate : {"false", "true"}) {
      const bool isolated = std::string(isolate) == "true";
      // Rounding is the process's own affair, and what it cannot describe it cannot greet with.
      if (isolated && (fault == "rounds" || fault == "describe")) continue;
      const std::string found = failure(library(NULLMARK_TRACKERS_LIBRARY, "ratio",
                                                fmt::format(R"("isolate":{},"parameters":{{"fault":"{}"}})", isolate, fault)));
      EXPECT_NE(found.find(said), std::string::npos) << fault << ", isolate " << isolate << ": " << found;
    }
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  const char* const crashed = "ended with exit code 1";  // sanitizers tell of the signal themselves
#else
  const char* const crashed = "ended by signal 11";
#endif
  const std::string found =
      failure(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("isolate":true,"parameters":{"fault":"crashes"})"));
  EXPECT_NE(found.find(crashed), std::string::npos) << found;
  EXPECT_NE(
      failure(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("isolate":true,"seconds":0.5,"parameters":{"fault":"sleeps"})"))
          .find("did not answer in 0.5 s"),
      std::string::npos);
  EXPECT_EQ(failure(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("isolate":true,"parameters":{"fault":"prints"})")), "ok");
}

TEST(Foreign, FractionsAreNoCoins) {
  // Ratio tracking that calls itself binary would be bet on like a coin.
  const CellRecord record = run(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"binary"})"), R"("linear")",
                                R"([{"type":"global","looseness":2}])")
                                .at(0);
  EXPECT_EQ(record.status, Status::error);
  EXPECT_NE(record.reason.find("states that its samples are 0 or 1, and one is "), std::string::npos) << record.reason;
}

TEST(Foreign, SamplesThatContradictTheirDescriptionFail) {
  const auto verdict_of = [](const char* fault) {
    return run(library(NULLMARK_TRACKERS_LIBRARY, "ratio", fmt::format(R"("parameters":{{"fault":"{}"}})", fault)), R"("linear")",
               R"(["global"])", 1, 65536)
        .at(0);
  };
  EXPECT_EQ(word(verdict_of("range")), "FAIL") << finding(verdict_of("range"));
  const CellRecord remembers = verdict_of("remembers");
  EXPECT_EQ(word(remembers), "FAIL") << finding(remembers);
}

TEST(Foreign, WhatIsNoTrackerIsRefused) {
  EXPECT_NE(refusal(library("/nowhere/libnone.so", "")).find("not a file"), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_SOURCE_DIR "/README.md", "")).find("cannot be loaded"), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_TRACKERS_LIBRARY, "")).find("expected one of ratio, ratio_with_theory, delta, own"),
            std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_TRACKERS_LIBRARY, "none")).find("has no tracker \"none\""), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_LATER_LIBRARY, "")).find("found interface version 2"), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_EMPTY_LIBRARY, "")).find("offers no tracker for interface version 1"), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_BARE_LIBRARY, "")).find("has no nullmark_get_tracker"), std::string::npos);
  EXPECT_NE(refusal(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"create"})"))
                .find("refuses its parameters {\"fault\":\"create\"}: no licence?for this machine"),
            std::string::npos);
  EXPECT_NE(refusal(process({"/nowhere/tracker"})).find("cannot be started: No such file"), std::string::npos);
  EXPECT_NE(refusal(process({"/bin/false"})).find("ended with exit code 1"), std::string::npos);
  EXPECT_NE(refusal(process({"/bin/cat"})).find("found frame 1; expected its welcome"), std::string::npos);
}

TEST(Foreign, FaultsOfAProcessEndTheirCell) {
  const std::map<std::string, std::string> faults = {
      {"dies", "ended with exit code 3; the last line of its standard error: the last words"},
      {"killed", "ended by signal 9"},
      {"hangs", "did not answer in 1 s"},
      {"closes", "closed its output"},
      {"floods", "breaks the protocol"},
      {"long", "found a frame of 2147483648 bytes; expected at most"},
      {"short", "bytes where"},
      {"sequence", "found frame number 77; expected 1"},
      {"prints", "does it print to its standard output?"},
      {"unasked", "found frame 3; expected a request or the result"},
      {"index", "names sample 1073741824 of a call"},
      {"shared", "shared memory that was not agreed on"},
      {"many", "expected at most"},
      {"nan", "samples are not finite"}};
  for (const auto& [fault, said] : faults) {
    const std::string found =
        failure(process({NULLMARK_FAULTY_PROCESS, fault}, fmt::format(R"("seconds":{})", fault == "hangs" ? 1 : 10)));
    EXPECT_NE(found.find(said), std::string::npos) << fault << ": " << found;
  }
  // A sample of 1 each time: a mean, though a wrong one.
  EXPECT_EQ(failure(process({NULLMARK_FAULTY_PROCESS})), "ok");
  const std::map<std::string, std::string> greetings = {{"silent", "did not answer in 1 s"},
                                                        {"magic", "no nullmark greeting"},
                                                        {"version", "found version 9; expected 1"},
                                                        {"endian", "not little-endian"},
                                                        {"json", "welcome:1:"},
                                                        {"words", "unknown range"}};
  for (const auto& [fault, said] : greetings) {
    const std::string found =
        refusal(process({NULLMARK_FAULTY_PROCESS, fault}, fmt::format(R"("seconds":{})", fault == "silent" ? 1 : 10)));
    EXPECT_NE(found.find(said), std::string::npos) << fault << ": " << found;
  }
}

TEST(Foreign, AFaultCostsItsCellAlone) {
  const auto records =
      run(fmt::format("[{},{},{}]", process({NULLMARK_FAULTY_PROCESS, "dies"}), process({NULLMARK_FAULTY_PROCESS}),
                      library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("isolate":true)")),
          R"([{"type":"homogeneous","extinction":1},"linear"])", R"(["global"])");
  ASSERT_EQ(records.size(), 6u);
  for (std::size_t i = 0; i < records.size(); ++i)
    EXPECT_EQ(records[i].status, i < 2 ? Status::error : Status::ok) << records[i].cell.name << ": " << records[i].reason;
}

}  // namespace
}  // namespace nullmark
