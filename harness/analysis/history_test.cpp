// What a history finds between results with planted changes, and that it finds nothing between those of one program.

#include "harness/analysis/history.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "harness/io/json_input.h"
#include "harness/report/history_text.h"
#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

constexpr const char* kOld = "2026-11-20T08:00:00Z";
constexpr const char* kNew = "2026-11-26T09:00:00Z";

/// Results of one configuration, commit and machine; `plant` may change them.
template <class Plant>
RunRecord dated(const char* start, Plant plant, std::vector<CellRecord> cells = {passed(), passed(), passed()}) {
  RunRecord run = run_of(std::move(cells));
  run.name = "c";
  run.provenance = {{"start", Json(start).dump()},
                    {"git", R"({"commit":"0123abcdef","dirty":false,"changes":""})"},
                    {"compiler", R"({"name":"gcc 12.2.0","flags":"-O3"})"},
                    {"target", R"({"march":"x86-64-v3","simd":"AVX2"})"},
                    {"libc", R"("glibc 2.36")"},
                    {"cpu", R"({"model":"one"})"}};
  for (CellRecord& record : run.cells) {
    record.samples = 100'000;
    record.lookups = 1'000'000;
    record.draws = 1'100'000;
    record.lookups_variance = 10;
    record.lookups_theory = 10;
    record.null_collisions_per_sample = 10;
    record.squared_error_blocks.assign(16, 0.25);
  }
  plant(run);
  return run;
}
RunRecord dated(const char* start) {
  return dated(start, [](RunRecord&) {});
}

void draw_with_another_seed(RunRecord& run) {
  for (CellRecord& record : run.cells) record.cell.id += "seed";
}

HistoryStep last(std::vector<RunRecord> runs, const std::vector<TimedBlock>& blocks = {}) {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < runs.size(); ++i) files.push_back(fmt::format("{}.json", i));
  return history_of(std::move(runs), files, blocks).steps.back();
}

/// What the history says of the same results with a change of the second cell.
template <class Plant>
std::string said(Plant plant, bool other_seed = false) {
  const HistoryStep step = last({dated(kOld), dated(kNew, [&](RunRecord& run) {
                                   if (other_seed) draw_with_another_seed(run);
                                   plant(run.cells[1]);
                                 })});
  return changes_counted(step);
}

TEST(History, SaysThatNothingChanged) {
  const History history = history_of({dated(kOld), dated(kNew)}, {"a", "b"});
  EXPECT_EQ(changes_line(history), "nothing changed since 2026-11-20 (commit 0123abc): 3 of 3 cells compared");
  EXPECT_EQ(history.steps.back().undecided.size(), 0u);
}

TEST(History, NamesEachChange) {
  const auto lookups = [](Real factor) {
    return [=](CellRecord& record) {
      record.lookups = static_cast<std::uint64_t>(std::llround(1e6 * factor));
      record.draws = record.lookups + 100'000;
    };
  };
  EXPECT_EQ(said(lookups(1.1)), "1 more lookups");
  EXPECT_EQ(said(lookups(0.9)), "1 fewer lookups");
  EXPECT_EQ(said(lookups(1.1), true), "1 more lookups");
  EXPECT_EQ(said(lookups(1.00001)), "1 other walks");
  EXPECT_EQ(said(lookups(1.00001), true), "");  // chance
  EXPECT_EQ(said([](CellRecord& record) { ++record.draws; }), "1 more draws");
  EXPECT_EQ(said([](CellRecord& record) { --record.draws; }), "1 fewer draws");
  EXPECT_EQ(said([](CellRecord& record) { *record.instructions = *record.instructions / 100 * 103; }), "1 more instructions");
  EXPECT_EQ(said([](CellRecord& record) { *record.instructions = *record.instructions / 100 * 97; }), "1 fewer instructions");
  EXPECT_EQ(said([](CellRecord& record) { *record.last_level_misses *= 2; }), "1 more cache misses");
  EXPECT_EQ(said([](CellRecord& record) { *record.last_level_misses /= 2; }), "1 fewer cache misses");
  EXPECT_EQ(said([](CellRecord& record) { record.squared_error_blocks.assign(16, 0.3); }), "1 larger error");
  EXPECT_EQ(said([](CellRecord& record) { record.squared_error_blocks.assign(16, 0.2); }), "1 smaller error");
  EXPECT_EQ(said([](CellRecord& record) { record.cell.samples_per_ray = 17; }), "");
  EXPECT_EQ(said([](CellRecord& record) { record.cell.estimator.edit([](Component& estimator) { estimator.type = "other"; }); }),
            "1 other setting");
  EXPECT_EQ(said([](CellRecord& record) { record.cell.name = "cell 7"; }), "1 new, 1 gone");
  EXPECT_EQ(said([](CellRecord& record) {
              record = unsampled(record, Status::error, "broke");
              record.cell.name = "cell 1";
            }),
            "1 verdict");
}

TEST(History, CallsAVerdictChangedOnlyWhereChanceCannotChangeIt) {
  const auto becomes = [](const CellRecord& other) {
    return [=](CellRecord& record) {
      record.verdict = other.verdict;
      record.reason = other.reason;
    };
  };
  EXPECT_EQ(said(becomes(failed())), "1 verdict");
  EXPECT_EQ(said(becomes(failed()), true), "1 verdict");  // a FAIL is a proof
  EXPECT_EQ(said(becomes(violated()), true), "1 verdict");
  EXPECT_EQ(said(becomes(open())), "1 verdict");  // of the same samples
  EXPECT_EQ(said(becomes(open()), true), "");
  const auto from = [&](CellRecord first) {
    return last({dated(kOld, [](RunRecord&) {}, {first, passed()}), dated(kNew, draw_with_another_seed, {passed(), passed()})});
  };
  EXPECT_EQ(from(open()).changed, 0u);
  EXPECT_EQ(from(open()).undecided.size(), 1u);
  EXPECT_EQ(from(violated()).changed, 0u);
  CellRecord beyond = failed();
  EXPECT_EQ(from(beyond).changed, 0u);  // a bias within epsilon may be proven, or passed
  beyond.verdict->tests[0].log_e_beyond = 100;
  EXPECT_EQ(from(beyond).changed, 1u);
}

TEST(History, OrdersResultsByTheirDates) {
  const auto failing = [](RunRecord& run) { run.cells[1].verdict = failed().verdict; };
  const char* kMiddle = "2026-11-20T09:00:00Z";
  const History history = history_of({dated(kNew, failing), dated(kOld), dated(kMiddle)}, {"new", "old", "middle"});
  ASSERT_EQ(history.results.size(), 3u);
  EXPECT_EQ(history.results[0].file, "old");
  EXPECT_EQ(history.results[1].date, "2026-11-20 09:00:00");  // two share a day
  EXPECT_EQ(history.steps[0].changed, 0u);
  EXPECT_EQ(changes_line(history), "1 of 3 cells changed since 2026-11-20 09:00:00 (commit 0123abc): 1 verdict");
  const std::string text = history_text(history, 0);
  EXPECT_LT(text.find("PASS"), text.find("FAIL")) << text;
  EXPECT_EQ(history_json(history)["cells"][1]["verdict"], Json({"PASS", "PASS", "FAIL"}));
}

TEST(History, CountsCopiesOnce) {
  const History history = history_of({dated(kOld), dated(kNew), dated(kNew)}, {"a", "b", "c"});
  EXPECT_EQ(history.results.size(), 2u);
  EXPECT_EQ(history.warnings, std::vector<std::string>{"c holds the same results as b and counts once"});
  EXPECT_TRUE(history_of({dated(kOld), dated(kOld)}, {"a", "a"}).steps.empty());
}

TEST(History, RefusesResultsThatAreNoSeries) {
  EXPECT_THROW(last({dated(kOld), dated(kNew, [](RunRecord& run) { run.name = "other"; })}), InputError);
  EXPECT_THROW(last({dated(kOld), dated(kNew, [](RunRecord& run) { run.provenance.erase("start"); })}), InputError);
  EXPECT_THROW(last({dated(kOld), dated(kNew,
                                        [](RunRecord& run) {
                                          for (CellRecord& one : run.cells) one.cell.name += "x";
                                        })}),
               InputError);
}

TEST(History, DoesNotMissCellsThatWereNotSelected) {
  const auto part = [](RunRecord& run) {
    run.cells.pop_back();
    run.provenance["filter"] = "\"cell [01]\"";
  };
  const HistoryStep gone = last({dated(kOld), dated(kNew, part)}), back = last({dated(kOld, part), dated(kNew)});
  EXPECT_EQ(gone.changed + back.changed, 0u);
  EXPECT_EQ(gone.compared, 2u);
  EXPECT_EQ(gone.notes.at(0), "1 cell in one of the results only, because the other holds a part of the cells");
}

TEST(History, NamesMergeForShardsAndCellsThatNeverRan) {
  const auto shard_of = [](const char* start, const char* shard, std::ptrdiff_t first, std::ptrdiff_t last) {
    return dated(start, [=](RunRecord& run) {
      run.cells = std::vector<CellRecord>(run.cells.begin() + first, run.cells.begin() + last);
      run.provenance["shard"] = fmt::format("\"{}\"", shard);
    });
  };
  EXPECT_EQ(
      last({shard_of(kOld, "1/2", 0, 2), shard_of(kNew, "2/2", 1, 3)}).notes.at(0),
      "2 cells in one of the results only, because both hold a part of the cells: `nullmark merge` joins shards of one run");
  try {
    last({shard_of(kOld, "1/2", 0, 1), shard_of(kNew, "2/2", 1, 3)});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("expected what `nullmark merge` makes of the shards"), std::string::npos)
        << error.what();
  }
  const auto skipped = [](RunRecord& run) { run.cells[1] = unsampled(run.cells[1], Status::skipped, "no such medium"); };
  EXPECT_EQ(last({dated(kOld, skipped), dated(kNew, skipped)}).notes.at(0), "1 cell not run in both results");
}

/// The results of a shard, whose cells are all drawn in part.
RunRecord shard(const char* start) {
  return dated(start, [](RunRecord& run) {
    run.provenance["shard"] = "\"1/2\"";
    for (CellRecord& cell : run.cells) {
      cell = unsampled(cell, Status::not_run, "parts of the cell are drawn");
      cell.drawn_parts = {"part"};
    }
  });
}

TEST(History, PutsAMergedResultAfterItsPart) {
  for (const bool merged_first : {false, true}) {
    std::vector<RunRecord> runs = {shard(kNew), dated(kNew)};
    std::vector<std::string> files = {"part", "merged"};
    if (merged_first) {
      std::swap(runs[0], runs[1]);
      std::swap(files[0], files[1]);
    }
    EXPECT_EQ(history_of(std::move(runs), files).results.back().file, "merged");
  }
}

TEST(History, SaysThatNothingWasComparedWithAShard) {
  const History history = history_of({dated(kOld), shard(kNew)}, {"a", "b"});
  const std::string text = history_text(history, 0);
  EXPECT_EQ(text.find("nothing could be compared since 2026-11-20"), 0u) << text;
  EXPECT_NE(text.find("2026-11-26  nothing was compared  "), std::string::npos) << text;
  EXPECT_EQ(history_json(history)["steps"][0]["says"], "nothing was compared");
}

TEST(History, ComparesAcrossPartsOfTheCells) {
  const auto failing = [](RunRecord& run) { run.cells[1].verdict = failed().verdict; };
  const auto few = [](RunRecord& run) {
    run.cells.erase(run.cells.begin() + 1, run.cells.end());
    run.provenance["shard"] = "\"1/2\"";
  };
  const char* kMiddle = "2026-11-22T09:00:00Z";
  for (const RunRecord& part : {shard(kMiddle), dated(kMiddle, few)}) {
    const History history = history_of({dated(kOld), part, dated(kNew, failing)}, {"old", "part", "new"});
    EXPECT_EQ(changes_line(history), "1 of 3 cells changed since 2026-11-20 (commit 0123abc): 1 verdict");
    const std::string text = history_text(history, 0);
    EXPECT_NE(text.find("\nnot compared with part, which has fewer cells to compare, but with old\n"), std::string::npos) << text;
    EXPECT_NE(text.find("2026-11-26  1 cell: 1 verdict, since 2026-11-20  "), std::string::npos) << text;
  }
  // The one before is enough where it is no part, and where nothing earlier has more of the cells.
  EXPECT_EQ(changes_line(history_of({dated(kOld), dated(kMiddle), dated(kNew, failing)}, {"a", "b", "c"})),
            "1 of 3 cells changed since 2026-11-22 (commit 0123abc): 1 verdict");
  const auto changed = [&](RunRecord& run) {
    few(run);
    run.cells[0].verdict = failed().verdict;
  };
  EXPECT_EQ(changes_line(history_of({dated(kOld), dated(kMiddle, few), dated(kNew, changed)}, {"a", "b", "c"})),
            "1 of 1 cells changed since 2026-11-22 (commit 0123abc): 1 verdict");
}

TEST(History, DoesNotCallCellsGoneThatAreDrawnInPartOrWereNeverStarted) {
  const auto in_part = [](RunRecord& run) {
    run.cells[1] = unsampled(run.cells[1], Status::not_run, "parts of the cell are drawn");
    run.cells[1].drawn_parts = {"part"};
  };
  for (const HistoryStep& step : {last({dated(kOld), dated(kNew, in_part)}), last({dated(kOld, in_part), dated(kNew)})}) {
    EXPECT_EQ(step.changed, 0u);
    EXPECT_EQ(step.compared, 2u);
  }
  // What is whole by now asks for nothing.
  EXPECT_EQ(last({dated(kOld), dated(kNew, in_part)})
                .notes.at(0)
                .find("1 cell drawn in part, so not compared: merge the results of all shards"),
            0u);
  EXPECT_EQ(last({dated(kOld, in_part), dated(kNew)}).notes.at(0), "1 cell drawn in part in the earlier result, so not compared");
  // Merged without a shard that had the last cell: nothing says that the cells were selected.
  const auto without = [](RunRecord& run) {
    run.cells.pop_back();
    run.config_text = R"({"experiments":[{"include":[{},{},{}]}]})";
  };
  const HistoryStep gone = last({dated(kOld), dated(kNew, without)}), back = last({dated(kOld, without), dated(kNew)});
  EXPECT_EQ(gone.changed + back.changed, 0u);
  EXPECT_EQ(gone.notes.at(0), "1 cell in one of the results only, because the other holds a part of the cells");
}

TEST(History, SaysWhyErrorsAreNotCompared) {
  const auto note = [](auto plant) {
    return last({dated(kOld), dated(kNew,
                                    [&](RunRecord& run) {
                                      run.cells[1].squared_error_blocks.clear();
                                      plant(run.cells[1]);
                                    })})
        .notes.at(0);
  };
  EXPECT_EQ(note([](CellRecord&) {}), "errors not compared: too few samples in 1 cell");
  EXPECT_EQ(note([](CellRecord& record) { record.outputs = {"one", "two"}; }), "errors not compared: several outputs in 1 cell");
  EXPECT_EQ(note([](CellRecord& record) { record.channel[0].reference.reset(); }), "errors not compared: no reference in 1 cell");
}

TEST(History, NamesTheSeeds) {
  const auto seeded = [](std::uint64_t seed) {
    return [seed](RunRecord& run) {
      draw_with_another_seed(run);
      for (CellRecord& record : run.cells) record.cell.seed = seed;
    };
  };
  const History history = history_of({dated(kOld), dated(kNew, seeded(7))}, {"a", "b"});
  EXPECT_EQ(history.steps.back().notes.at(0), "other seed (1 → 7) in 3 cells: their samples differ by chance");
  EXPECT_EQ(last({dated(kOld, seeded(7)), dated(kNew, seeded(7))}).notes.size(), 0u);
}

TEST(History, NamesTheNumbersOfSamples) {
  const History history = history_of({dated(kOld), dated(kNew,
                                                         [](RunRecord& run) {
                                                           for (std::size_t i = 0; i < 3; ++i)
                                                             run.cells[i].cell.samples_per_ray = 17 + i;
                                                         })},
                                     {"a", "b"});
  const std::string before = std::to_string(passed().cell.samples_per_ray);
  EXPECT_EQ(changes_line(history), "nothing changed since 2026-11-20 (commit 0123abc) but samples_per_ray (" + before +
                                       " → 17, " + before + " → 18, and 1 more), in 3 of 3 cells");
}

TEST(History, ComparesNoExactCountsOfAnotherBuildOrOfSamplesThatCannotBeDrawnAgain) {
  const auto more = [](RunRecord& run) { run.cells[1].lookups += 10; };
  const HistoryStep build = last({dated(kOld), dated(kNew, [&](RunRecord& run) {
                                    more(run);
                                    run.provenance["libc"] = "\"glibc 2.40\"";
                                  })});
  EXPECT_EQ(build.changed, 0u);
  EXPECT_EQ(build.notes.at(0), "exact counts not compared: another build, or one that does not say what it is in 3 cells");
  const auto unrepeatable = [&](RunRecord& run) { run.cells[1].tracker.unrepeatable = true; };
  EXPECT_EQ(last({dated(kOld, unrepeatable), dated(kNew,
                                                   [&](RunRecord& run) {
                                                     unrepeatable(run);
                                                     more(run);
                                                   })})
                .changed,
            0u);
}

/// Errors of a square with heavy tails.  Of 1000 comparisons of 3 cells, 1e-4 * 1000 = .1 may show a change: 3 or more in 2e-4 of
/// all seeds.
TEST(History, CallsNoNoiseOfErrorsAChange) {
  std::mt19937_64 random(11);
  std::cauchy_distribution<Real> law;
  const auto noise = [&](RunRecord& run) {
    for (CellRecord& record : run.cells)
      for (Real& part : record.squared_error_blocks) part = std::pow(law(random), 2);
  };
  std::size_t changed = 0;
  for (int pair = 0; pair < 1000; ++pair) changed += last({dated(kOld, noise), dated(kNew, noise)}).changed;
  EXPECT_LE(changed, 2u);
}

}  // namespace
}  // namespace nullmark
