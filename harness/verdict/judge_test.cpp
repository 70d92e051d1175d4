// What verdicts say of trackers that are wrong in ways a mean at epsilon does not show, and of right ones that it would not pass.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/analysis/check.h"
#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

std::vector<CellRecord> run_on_a_line(const std::string& experiment, std::uint64_t seed = 1) {
  return run_untimed(read_config(
      fmt::format(
          R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e","rays":{{"type":"single",
              "from":[0,0.5,0.5],"to":[1,0.5,0.5]}},{}}}]}})",
          experiment),
      "judging.json", seed));
}

const VerdictRecord& first_verdict(const std::vector<CellRecord>& records) { return records.at(0).verdict.value(); }

/// A bias of 0, .3, .9 and 1.1 epsilon where epsilon is tolerated: never a FAIL below it, never a PASS above.
TEST(Judging, ToleratingEpsilonIsNeverWrong) {
  struct Case {
    Real part;
    const char* tracker;
    Real epsilon;
    int passes = 0, fails = 0;
  };
  for (Case one : {Case{0, "ratio", 0.01}, Case{0.3, "planted_slight", 0.01}, Case{0.9, "planted_slight", 0.003 / 0.9},
                   Case{1.1, "planted_slight", 0.003 / 1.1}}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const auto records = run_on_a_line(
          fmt::format(
              R"("samples_per_ray":4096,"verdict":{{"epsilon":{},"tolerate":"epsilon","max_samples_per_ray":400000,"laws":"never"}},
                  "matrix":{{"estimator":"{}","medium":{{"type":"homogeneous","extinction":1}},
                             "majorant":{{"type":"global","looseness":50}}}})",
              one.epsilon, one.tracker),
          seed);
      one.passes += first_verdict(records).unbiased == Outcome::pass;
      one.fails += first_verdict(records).unbiased == Outcome::fail;
    }
    std::printf("bias %.1f epsilon: %d PASS, %d FAIL, %d open of 100\n", one.part, one.passes, one.fails,
                100 - one.passes - one.fails);
    if (one.part < 1) {
      EXPECT_EQ(one.fails, 0);
    } else {
      EXPECT_EQ(one.passes, 0);
    }
    if (one.part < 0.5) {
      EXPECT_EQ(one.passes, 100);
    }
  }
}

/// It has no flights that could depend on each other.
TEST(Judging, ATrackerThatTakesNoFlightBreaksNoLawOfThem) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":1024,"verdict":{"laws":"always"},"matrix":{"estimator":"planted_reference","medium":{"type":"linear"},
          "majorant":{"type":"global","looseness":2}})");
  for (const LawRecord& law : first_verdict(records).laws)
    EXPECT_FALSE(law.name == "independence" && law.outcome == Outcome::fail) << law.log_e;
}

/// Walks of 2e6 lookups where theory states fewer than 100: their record would not fit memory.
TEST(Judging, WalksThatOutgrowARecordingAreSaidToBeUntested) {
  const auto records = run_on_a_line(R"("samples_per_ray":2,"verdict":{"laws":"always","max_samples_per_ray":2},
                              "matrix":{"estimator":"planted_decomposition_reset","medium":{"type":"linear","optical_depth":100},
                                        "majorant":{"type":"global","looseness":100}})");
  EXPECT_EQ(first_verdict(records).untested,
            std::vector<std::string>{"laws of walks: walks take more lookups than a recording holds"});
}

/// A plan above the samples is not drawn without an allowance, and the cell says so beforehand, also where four times the samples
/// would be sure to decide it.
TEST(Judging, APlanAboveTheSamplesIsNotExpectedToBeDecided) {
  const std::string cell = R"("samples_per_ray":300000{},"matrix":{{"estimator":"ratio","medium":"cosine"}})";
  const auto without = run_on_a_line(fmt::format(fmt::runtime(cell), R"(,"verdict":{"epsilon":0.01})"));
  EXPECT_GT(first_verdict(without).planned, 300000u);
  EXPECT_TRUE(first_verdict(without).planned_undecidable);
  EXPECT_EQ(first_verdict(without).reason.rfind("not decidable at 300000 samples a ray", 0), 0u) << first_verdict(without).reason;
  const auto with =
      run_on_a_line(fmt::format(fmt::runtime(cell), R"(,"verdict":{"epsilon":0.01,"max_samples_per_ray":1200000})"));
  EXPECT_EQ(first_verdict(with).unbiased, Outcome::pass);
}

/// The same bias where none is tolerated: a FAIL once the samples are enough for it, and its size is told.
TEST(Judging, ToleratingNothingFindsWhatIsBelowEpsilon) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":1000000,"verdict":{"epsilon":0.01},"matrix":{"estimator":"planted_slight",
         "medium":{"type":"homogeneous","extinction":1},"majorant":{"type":"global","looseness":50}})");
  EXPECT_EQ(first_verdict(records).unbiased, Outcome::fail);
  EXPECT_TRUE(first_verdict(records).biased);
  EXPECT_FALSE(first_verdict(records).beyond);
  EXPECT_NE(first_verdict(records).reason.find("+0.3 %"), std::string::npos) << first_verdict(records).reason;
}

/// PASS takes the planned samples, also where the margin is proven sooner.
TEST(Judging, APassTakesThePlannedSamples) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":1024,"verdict":{"max_samples_per_ray":4000000},"matrix":{"estimator":["delta","ratio"],
         "medium":{"type":"linear","optical_depth":[0.1,1]}})");
  for (const CellRecord& record : records) {
    EXPECT_EQ(record.verdict->unbiased, Outcome::pass) << record.cell.name;
    EXPECT_GE(record.verdict->samples_per_ray, record.verdict->planned);
    std::uint64_t planned = 1024;
    for (const TestRecord& test : record.verdict->tests)
      if (test.basis != TestBasis::counted) planned = std::max(planned, test.planned);
    EXPECT_LE(record.verdict->samples_per_ray, 3 * planned);
    EXPECT_EQ(record.verdict->proves.rfind("|bias| < ", 0), 0u) << record.verdict->proves;
  }
}

/// A plan that is affordable is drawn, though not four times over.
TEST(Judging, WhatIsAffordableIsDrawn) {
  const std::string cell = R"("samples_per_ray":1024,"verdict":{{"max_samples_per_ray":{}}},"matrix":{{"estimator":"delta",
      "medium":{{"type":"homogeneous","extinction":1}},"majorant":{{"type":"global","looseness":2}}}})";
  const std::uint64_t planned = first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), 100'000'000))).planned;
  const auto records = run_on_a_line(fmt::format(fmt::runtime(cell), planned + planned / 4));
  EXPECT_GT(first_verdict(records).samples_per_ray, planned);
  EXPECT_TRUE(first_verdict(records).planned_undecidable);  // a right tracker may stay open there
  const auto beyond = run_on_a_line(fmt::format(fmt::runtime(cell), planned / 2));
  EXPECT_EQ(first_verdict(beyond).samples_per_ray, 1024u);
}

/// The allowance is drawn on where half of what proves a bias is there, and where the configuration says so.
TEST(Judging, AnAllowanceTooSmallIsDrawnForAPromiseOrOnRequest) {
  const std::string cell = R"("samples_per_ray":2048,"verdict":{{"epsilon":1e-4,"max_samples_per_ray":20000{}}},
      "matrix":{{"estimator":"{}","medium":{{"type":"homogeneous","extinction":1}},"majorant":{{"type":"global","looseness":2}}}})";
  EXPECT_EQ(first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), "", "delta"))).samples_per_ray, 2048u);
  EXPECT_GE(first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), R"(,"samples":"all")", "delta"))).samples_per_ray,
            20000u);
  // A bias of -40 % shows in the first 2048 samples.
  EXPECT_EQ(first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), "", "planted_whole_depth"))).unbiased, Outcome::fail);
}

/// No lookup is met by a bound of 1e-30, so none is counted above it; the medium's own points tell.
TEST(Judging, AViolationNeedsNoLookup) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":4096,"matrix":{"estimator":"delta","medium":{"type":"homogeneous","extinction":1},
         "majorant":{"type":"prescribed","value":[1e-30,1e-5]}})");
  for (const CellRecord& record : records) EXPECT_EQ(record.verdict->unbiased, Outcome::violated) << record.cell.name;
  // Only the box's bound is above the rate here: the cell is judged, and what is not proven is said.
  const auto noise = run_on_a_line(
      R"("samples_per_ray":1048576,"matrix":{"estimator":"delta","medium":{"type":"fractal_noise","peak":3},
         "majorant":{"type":"prescribed","value":2.5}})");
  EXPECT_EQ(first_verdict(noise).unbiased, Outcome::pass);
  EXPECT_TRUE(first_verdict(noise).bound_unproven);
}

/// A given reference with an error does not take the place of a closed form, nor break the law of the variance.
TEST(Judging, AGivenReferenceKeepsATighterOne) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":20000,"reference":{"value":0.5,"error":0.6,"source":"a guess"},"verdict":{"laws":"always"},
         "matrix":{"estimator":"ratio","medium":{"type":"homogeneous","extinction":1.01}})");
  EXPECT_EQ(records.at(0).reference_method, "closed_form");
  EXPECT_NE(first_verdict(records).lawful, Outcome::fail);
}

/// Coordinates that double tells to fewer digits than epsilon: no verdict, rather than a false one; nearer ones are judged.
TEST(Judging, FarCoordinatesAreNoBias) {
  for (const auto& [from, to] : {std::pair{"1e15", "1000000000000001"}, {"1e11", "100000000001"}, {"1e7", "10000001"}}) {
    const auto records =
        run_untimed(read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",
            "rays":{{"type":"orthographic","axis":"x","width":1,"height":1}},"samples_per_ray":65536,
            "matrix":{{"estimator":["closed_form","regular","delta","ratio","residual_ratio","next_flight_ratio",
                                    "unbiased_ray_marching","p_series_cmf"],
                       "medium":{{"type":"linear","lo":[{},0,0],"hi":[{},1,1],"optical_depth":1}}}}}}]}})",
                                            from, to),
                                "far.json"));
    for (const CellRecord& record : records) {
      const bool farthest = std::string(from) == "1e15";
      EXPECT_EQ(record.status, farthest ? Status::skipped : Status::ok) << record.cell.name << record.reason;
      if (record.verdict) {
        EXPECT_NE(record.verdict->unbiased, Outcome::fail) << record.cell.name << ": " << record.verdict->reason;
      }
    }
  }
}

/// A ray that begins far away has no digits left where it meets the medium.
TEST(Judging, RaysFromFarAwayAreNoBias) {
  for (const auto& [from, precision] :
       {std::pair{"-1e15", "double"}, {"-1e12", "double"}, {"-1e7", "float"}, {"-1e3", "float"}}) {
    const auto records = run_untimed(read_config(
        fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e","precision":"{}",
            "rays":{{"type":"single","from":[{},0.5,0.5],"to":[2,0.5,0.5]}},"samples_per_ray":65536,
            "matrix":{{"estimator":["ratio","delta"],"medium":"linear","majorant":["global",{{"type":"grid","resolution":16}}]}}}}]}})",
                    precision, from),
        "far.json"));
    for (const CellRecord& record : records) {
      const bool farthest = std::string(from) == "-1e15" || std::string(from) == "-1e7";
      EXPECT_EQ(record.status, farthest ? Status::skipped : Status::ok) << from << record.cell.name << record.reason;
      if (record.verdict) {
        EXPECT_NE(record.verdict->unbiased, Outcome::fail) << from << record.cell.name << ": " << record.verdict->reason;
        EXPECT_NE(record.verdict->lawful, Outcome::fail) << from << record.cell.name << ": " << record.verdict->reason;
      }
    }
  }
}

/// Theory meets the narrow peak of a steep profile.
TEST(Judging, SteepProfilesAreNoBias) {
  const auto records = run_on_a_line(R"("samples_per_ray":100000,"verdict":{"laws":"always"},
      "matrix":{"estimator":["ratio","delta","residual_ratio"],"medium":{"type":"exponential","rate":[-70,-300,-700]}})");
  for (const CellRecord& record : records) {
    EXPECT_NE(record.verdict.value().unbiased, Outcome::fail) << record.cell.name << ": " << record.verdict->reason;
    EXPECT_NE(record.verdict->lawful, Outcome::fail) << record.cell.name << ": " << record.verdict->reason;
    EXPECT_NEAR(*record.channel.at(0).variance / *record.channel[0].variance_theory, 1, 0.2) << record.cell.name;
  }
}

/// The extinction is unbounded at y = 0, which the ray does not touch.
TEST(Judging, APoleElsewhereIsNoBias) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":200000,"verdict":{"epsilon":0.02,"laws":"always"},
         "matrix":{"estimator":["ratio","next_flight_ratio"],"medium":{"type":"exponential_cube","axis":"y"},
                   "majorant":{"type":"prescribed","value":2}})");
  for (const CellRecord& record : records) {
    EXPECT_LT(record.channel.at(0).reference_error.value_or(kInfinity), 1e-12);
    EXPECT_EQ(record.verdict.value().unbiased, Outcome::pass) << record.verdict->reason;
    EXPECT_NE(record.verdict->lawful, Outcome::fail);
  }
}

/// A stated variance that is too small, or of samples with a range too large, is no variance to rest a proof on.
TEST(Judging, StatedVariancesAreTested) {
  const std::string cell =
      R"("samples_per_ray":65536,"verdict":{{"epsilon":0.05}},"matrix":{{"estimator":{{"type":"planted_variance",
      "factor":{}}},"medium":{{"type":"homogeneous","extinction":1}},"majorant":{{"type":"global","looseness":2}}}})";
  for (const Real factor : {0.23, 4.})
    EXPECT_EQ(first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), factor))).lawful, Outcome::fail);
  EXPECT_EQ(first_verdict(run_on_a_line(fmt::format(fmt::runtime(cell), 1.))).lawful, Outcome::pass);
}

/// No lookup at all, as stated: right, and nothing is divided by 0.
TEST(Judging, NoLookupIsACountToo) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":4096,"matrix":{"estimator":{"type":"planted_exact","error":0},
         "medium":{"type":"homogeneous","extinction":1}})");
  EXPECT_EQ(first_verdict(records).lookups, Outcome::pass);
}

/// The guarantee "exact" is one on every sample.
TEST(Judging, ExactMeansEverySample) {
  const auto records = run_on_a_line(
      R"("samples_per_ray":64,"matrix":{"estimator":[{"type":"planted_exact","error":0},{"type":"planted_exact","error":1e-9}],
         "medium":{"type":"homogeneous","extinction":1}})");
  EXPECT_EQ(records.at(0).verdict->unbiased, Outcome::pass);
  EXPECT_EQ(records.at(1).verdict->unbiased, Outcome::fail);
}

/// Lookups of flights that the harness draws are counted walk by walk; a tracker that looks up twice has none that count.
TEST(Judging, LookupsAreCountedWhereTheFlightIsTheHarnesss) {
  const auto verdict = [](const std::string& tracker) {
    return first_verdict(run_on_a_line(fmt::format(
        R"("samples_per_ray":4096,"verdict":{{"max_samples_per_ray":4000000}},"matrix":{{"estimator":"{}",
           "medium":{{"type":"homogeneous","extinction":0.1}},"majorant":{{"type":"global","looseness":2}}}})",
        tracker)));
  };
  EXPECT_GE(verdict("ratio").counted_walks, 688u);
  EXPECT_EQ(verdict("ratio").lookups, Outcome::pass);
  EXPECT_EQ(verdict("delta").counted_walks, 0u);
  EXPECT_EQ(verdict("planted_second_lookup").counted_walks, 0u);
  EXPECT_EQ(verdict("planted_second_lookup").lookups, Outcome::fail);
}

}  // namespace
}  // namespace nullmark
