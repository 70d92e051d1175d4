// What a run keeps whatever the number of threads: every cell told of once, results in the plan's order, errors not swallowed.

#include "harness/run/run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <stdexcept>

#include "harness/analysis/check.h"
#include "harness/analysis/hard_case_table.h"
#include "harness/config/config.h"
#include "harness/io/results_json.h"
#include "harness/model/metrics.h"
#include "harness/registry/components.h"
#include "harness/report/check_text.h"
#include "harness/report/comparison_text.h"
#include "harness/report/data.h"
#include "harness/report/export.h"
#include "harness/report/results_tables.h"
#include "harness/sampling/timing.h"

namespace nullmark {
namespace {

Plan plan() {
  return read_config(R"({"nullmark":"config/2","name":"test","timing":{"enabled":false},
      "experiments":[{"name":"cells","rays":{"type":"orthographic","width":5,"height":4},
        "matrix":{"samples_per_ray":[2,64,1000],"estimator":["ratio","delta","next_flight_ratio"],
                  "medium":[{"type":"cosine","optical_depth":[0.5,2]},{"type":"linear","optical_depth":[0.5,1]}]}}]})",
                     "test.json");
}

std::vector<CellRecord> run(const Plan& plan, int threads, const RunObserver& observer) {
  RunOptions options;
  options.threads = threads;
  options.timing = false;
  return unshared(run_plan(plan, std::vector<bool>(plan.cells.size(), true), {}, options, observer));
}

/// Single precision is skipped where it has no digits for a position or a flight, and what it adds to a mean is no bias.
TEST(Run, FloatIsRefusedWhereItHasNoDigits) {
  const auto only_record = [](const std::string& matrix, const std::string& tracker = R"("ratio")") {
    const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e",
        "rays":{"type":"single"},"samples_per_ray":20000,"matrix":{"estimator":)" +
                                       tracker + R"(,"precision":"float",)" + matrix + "}}]}",
                                   "test.json");
    return run(cells, 1, {}).at(0);
  };
  const auto refused = [&](const std::string& matrix, const std::string& why, const std::string& tracker = R"("ratio")") {
    const CellRecord record = only_record(matrix, tracker);
    EXPECT_EQ(record.status, Status::skipped) << matrix;
    EXPECT_NE(record.reason.find(why), std::string::npos) << record.reason;
    EXPECT_NE(record.reason.find("\"double\""), std::string::npos) << record.reason;
  };
  refused(R"("medium":{"type":"checkerboard","lo":[2000,0,0],"hi":[2001,1,1]})", "from the origin of its frame");
  refused(R"("medium":"linear","majorant":{"type":"prescribed","value":16385})", "majorant depth 16385");
  refused(R"("medium":"linear","lanes":false)", "ratio has no walks one at a time in float; expected \"lanes\": true");
  refused(R"("medium":"linear")", "spectral has no form in float with these parameters; expected its defaults",
          R"({"type":"spectral","control":"minimum"})");
  EXPECT_EQ(only_record(R"("medium":{"type":"checkerboard","lo":[1000,0,0],"hi":[1001,1,1]})").status, Status::ok);
  // Every one of 10 000 factors of a weight rounds to the same side, by a share of the mean that sampling does show.
  const CellRecord loose =
      only_record(R"("medium":{"type":"homogeneous","extinction":1},"majorant":{"type":"global","looseness":10000})");
  ASSERT_TRUE(loose.verdict);
  EXPECT_NE(loose.verdict->unbiased, Outcome::fail);
  EXPECT_GT(loose.verdict->tests.at(0).reference_error, 1e-4);
}

/// Bounds that are hardly looser than the extinction leave variances far below the rounding of a squared mean.  A theory that
/// calls them 0 makes every sample a bias.
TEST(Run, BoundsThatAreHardlyLooseAreNoBias) {
  std::string trackers;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries())
    if (!entry.planted && !entry.foreign && !entry.ignores_majorant)
      trackers += (trackers.empty() ? "\"" : ",\"") + entry.name + "\"";
  const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",
      "samples_per_ray":2000,"matrix":{"estimator":[)" +
                                     trackers + R"(],
      "medium":[{"type":"homogeneous","extinction":[1e-6,1]},{"type":"linear","begin":1,"end":1.000000001}],
      "majorant":{"type":"global","looseness":[1.0000000001,1.00000001,1.000001]}}}]})",
                                 "test.json");
  std::size_t passed = 0;
  for (const CellRecord& record : run(cells, 2, {})) {
    const bool biased = record.claims == "biased" || record.claims.empty();
    if (!record.verdict || biased) continue;
    EXPECT_NE(record.verdict->unbiased, Outcome::fail) << record.cell.name << ": " << record.verdict->reason;
    EXPECT_NE(record.verdict->lawful, Outcome::fail) << record.cell.name;
    passed += record.verdict->unbiased == Outcome::pass;
  }
  EXPECT_GT(passed, 40u);
}

TEST(Run, ATrackerThatAnswersOnGreyMediaAloneSaysSo) {
  const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",
      "samples_per_ray":4,"quantity":"free_path","matrix":{"estimator":["delta","ratio"],
      "medium":{"type":"linear","spectrum":[1,2,3,4]}}}]})",
                                 "test.json");
  const std::vector<CellRecord> records = run(cells, 1, {});
  EXPECT_EQ(records[0].status, Status::skipped);
  EXPECT_EQ(records[0].reason.find("delta does not answer free_path on 4 channels; take a grey medium, or a tracker that does: "),
            0u)
      << records[0].reason;
  EXPECT_NE(records[0].reason.find("spectral"), std::string::npos) << records[0].reason;
  // Another medium does not help.
  EXPECT_EQ(records[1].reason, "ratio does not answer free_path");
}

/// What is left of samples that are not all finite has no say.
TEST(Run, ACellThatIsNotFiniteKeepsReferencesAndTheoryAlone) {
  const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",
      "samples_per_ray":64,"matrix":{"estimator":{"type":"planted_nan","chance":0.5},
      "medium":["linear",{"type":"linear","spectrum":[1,2]}]}}]})",
                                 "test.json");
  RunRecord results;
  results.cells = run(cells, 1, {});
  RunRecord again = read_results(results_text(results), "r.json");
  for (const CellRecord& record : again.cells) {
    EXPECT_EQ(record.status, Status::error);
    EXPECT_GT(record.nonfinite, 0u);
    ASSERT_EQ(record.channel.size(), static_cast<std::size_t>(record.channels));
    for (const ChannelRecord& channel : record.channel) {
      EXPECT_TRUE(channel.reference);
      for (const auto& figure : {channel.mean, channel.bias, channel.rmse, channel.variance, channel.kurtosis})
        EXPECT_FALSE(figure);
      EXPECT_EQ(channel.relative_variance.has_value(), channel.variance_theory.has_value());
    }
    EXPECT_TRUE(record.convergence.empty());
    EXPECT_TRUE(record.squared_error_blocks.empty());
    EXPECT_GT(record.lookups, 0u) << "walks are counted all the same";
  }
  // Nothing that shows results stumbles over what is absent.
  const Summary summary = summarise(again);
  EXPECT_EQ(summary.errors, 2u);
  EXPECT_NE(summary_text(again, summary).find("ERROR: "), std::string::npos);
  EXPECT_NE(results_tables(again).find("error: "), std::string::npos);
  EXPECT_NE(stability_text(again).find("2 ERROR"), std::string::npos);
  EXPECT_EQ(compare_text({again}, "", true), "");
  EXPECT_TRUE(report_data({again}, {"r.json"}, "", "").json["cells"][0]["mean"][0].is_null());
  for (const std::string& format : export_formats()) EXPECT_FALSE(export_results(again, format, "r.json").empty());
  EXPECT_EQ(export_results(again, "csv", "r.json").find(",nan,"), std::string::npos);
}

/// A tracker that is wrong where there is nothing to meet is wrong.
TEST(Run, ABiasIsProvenEvenInVacuum) {
  const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e",
      "rays":{"type":"single","from":[0,0.5,0.5],"to":[1,0.5,0.5]},"samples_per_ray":20000,
      "matrix":{"estimator":["ratio","planted_zero"],"medium":{"type":"homogeneous","extinction":0}}}]})",
                                 "test.json");
  const std::vector<CellRecord> records = run(cells, 1, {});
  EXPECT_FALSE(records.at(0).verdict);
  EXPECT_EQ(records[0].reason, "no ray meets any extinction: nothing was tested; the medium's bounds are [0, 0, 0] to [1, 1, 1]");
  ASSERT_TRUE(records.at(1).verdict);
  EXPECT_EQ(records[1].verdict->unbiased, Outcome::fail);
}

TEST(Run, TheShareOfWaitingIsWhatTheThreadsClockLacks) {
  EXPECT_EQ(waiting_share(4, 3), 0.25);
  EXPECT_EQ(waiting_share(4, 4), 0);
  EXPECT_EQ(waiting_share(4, 4.5), 0);
  EXPECT_EQ(waiting_share(0, 0), 0);
}

/// Fewer samples share the cost of a walk through many cells, so each costs more.
TEST(Run, TimesEveryNumberOfSamplesPerTraversal) {
  const Plan cells =
      read_config(R"({"nullmark":"config/2","timing":{"repetitions":9,"seconds":0.005,"samples_per_traversal":[1,16,64]},
      "experiments":[{"name":"e","rays":"single","samples_per_ray":10,"verdict":{"enabled":false},
      "matrix":{"estimator":"ratio","medium":"linear","majorant":{"type":"grid","resolution":64}}}]})",
                  "test.json");
  const CellRecord record = *run_plan(cells, {true}, {}, {}, {}).at(0);
  ASSERT_TRUE(record.time);
  EXPECT_EQ(record.time->samples_per_traversal, 64u);
  ASSERT_EQ(record.time->batches.size(), 3u);
  EXPECT_EQ(record.time->batches[1].samples_per_traversal, 16u);
  EXPECT_EQ(record.time->batches[2].ns_per_sample, record.time->ns_per_sample);
  EXPECT_GT(record.time->batches[0].ns_per_sample, 2 * record.time->ns_per_sample);
  EXPECT_EQ(record.time->repetition_ns.size(), 9u);
  ASSERT_TRUE(record.time->waiting);
}

TEST(Run, TimesOneSampleAloneUnasked) {
  const Plan cells = read_config(R"({"nullmark":"config/2","timing":{"repetitions":2,"seconds":0.001},
      "experiments":[{"name":"e","rays":"single","samples_per_ray":10,"verdict":{"enabled":false},
      "matrix":{"estimator":"ratio","medium":"linear"}}]})",
                                 "test.json");
  const CellRecord record = *run_plan(cells, {true}, {}, {}, {}).at(0);
  ASSERT_TRUE(record.time);
  EXPECT_EQ(record.time->samples_per_traversal, 64u);
  ASSERT_EQ(record.time->batches.size(), 2u);
  EXPECT_EQ(record.time->batches[0].samples_per_traversal, 1u);
  EXPECT_EQ(metric(record, "ns_per_sample_alone"), record.time->batches[0].ns_per_sample);
}

TEST(Run, TellsOfEveryCellOnceAndOneAtATime) {
  const Plan cells = plan();
  for (const int threads : {1, 4}) {
    RunObserver observer;
    std::vector<std::string> told;
    std::atomic<int> telling = 0;
    observer.cell_done = [&](const SharedRecord& record, std::size_t done, std::size_t total) {
      EXPECT_EQ(++telling, 1);
      told.push_back(record->cell.id);
      EXPECT_EQ(done, told.size());
      EXPECT_EQ(total, cells.cells.size());
      --telling;
    };
    observer.progress = [&](const CellRecord&, double fraction) {
      EXPECT_EQ(++telling, 1);
      EXPECT_TRUE(fraction > 0 && fraction <= 1);
      --telling;
    };
    const std::vector<CellRecord> records = run(cells, threads, observer);
    ASSERT_EQ(records.size(), cells.cells.size());
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < records.size(); ++i) {
      EXPECT_EQ(records[i].cell.id, cells.cells[i].id);
      EXPECT_EQ(records[i].status, Status::ok);
      ids.push_back(records[i].cell.id);
    }
    std::sort(ids.begin(), ids.end());
    std::sort(told.begin(), told.end());
    EXPECT_EQ(told, ids);
  }
}

TEST(Run, AnObserverThatThrowsEndsIt) {
  const Plan cells = plan();
  RunObserver observer;
  std::size_t told = 0;
  observer.cell_done = [&](const SharedRecord&, std::size_t, std::size_t) {
    if (++told == 3) throw std::runtime_error("disk full");
  };
  EXPECT_THROW(run(cells, 4, observer), std::runtime_error);
  EXPECT_EQ(told, 3u);
}

/// The interrupt comes when all samples are drawn and the laws, the replay and the reliance are not yet tested.
TEST(Run, ACellThatIsCutOffAfterItsSamplesIsNotDone) {
  const Plan plan = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",
      "samples_per_ray":65536,"matrix":{"estimator":"ratio","medium":{"type":"linear","optical_depth":0.1}}}]})",
                                "test.json");
  std::atomic<int> interrupted{0};
  RunOptions options;
  options.timing = false;
  options.interrupted = &interrupted;
  RunObserver observer;
  observer.progress = [&](const CellRecord&, double fraction) {
    if (fraction >= 1) interrupted = SIGINT;
  };
  const CellRecord record = *run_plan(plan, {true}, {}, options, observer).at(0);
  EXPECT_EQ(record.status, Status::not_run);
  EXPECT_EQ(record.reason, kInterrupted);
  EXPECT_FALSE(record.verdict);
}

TEST(Run, TellsWhatEachPhaseTook) {
  RunObserver observer;
  std::vector<std::string> phases;
  observer.phase = [&](const Phase& phase) {
    phases.push_back(phase.name);
    EXPECT_GT(phase.wall, 0);
    EXPECT_GT(phase.cpu, 0);
  };
  run(plan(), 2, observer);
  EXPECT_EQ(phases, (std::vector<std::string>{"preparation", "theory", "sampling"}));
}

TEST(Run, StatisticsHoldTheVerdict) {
  RunObserver observer;
  double verdict = -1, statistics = -1;
  observer.verdict_share = [&](double share) { verdict = share; };
  observer.statistics_share = [&](double share) { statistics = share; };
  run(plan(), 2, observer);
  EXPECT_GT(verdict, 0);
  EXPECT_GT(statistics, verdict);
}

}  // namespace
}  // namespace nullmark
