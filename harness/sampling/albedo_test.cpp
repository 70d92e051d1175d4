// Absorption and scattering that vary apart: what is sampled of them, what theory says, and what is refused.

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>

#include "harness/analysis/check.h"
#include "harness/config/config.h"
#include "harness/io/json_input.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

constexpr const char* kApart =
    R"({"type":"sum","media":[{"type":"linear","begin":0,"end":2,"albedo":0},{"type":"linear","begin":2,"end":0,"albedo":1}]})";

std::string config(const std::string& estimator, const std::string& medium, const std::string& more) {
  return R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":{"type":"single","from":[0,0.5,0.5],
    "to":[1,0.5,0.5]},"samples_per_ray":65536,)" +
         more + R"("matrix":{"estimator":)" + estimator + R"(,"medium":)" + medium + "}}]}";
}

std::vector<CellRecord> cells(const std::string& estimator, const std::string& medium, const std::string& more) {
  RunRecord run;
  run.cells = run_untimed(read_config(config(estimator, medium, more), "c.json"));
  summarise(run);
  return run.cells;
}

std::string error_of(const std::string& estimator, const std::string& medium) {
  try {
    cells(estimator, medium, R"("quantity":"free_path",)");
  } catch (const InputError& error) {
    return error.what();
  } catch (const ParameterError& error) {
    return error.parameter + ": " + error.what();
  }
  return "no error";
}

/// int mu_a T = 1/2 - 3/2 e^-2 and the rest of 1 - T, for mu_a = 2x, mu_s = 2(1 - x) on [0, 1].
TEST(Albedo, AbsorbedAndScatteredOfCoefficientsApart) {
  const Real absorbed = 0.5 - 1.5 * std::exp(-2), scattered = 1 - std::exp(-2) - absorbed;
  EXPECT_NEAR(absorbed, 0.29700, 1e-5);
  const auto records = cells(
      R"(["delta","weighted_delta","spectral","null_collision","regular_inversion",
          {"type":"weighted_decomposition","control":"given","controls":[1],"control_albedo":[0.5]}])",
      kApart, R"("quantity":"free_path","verdict":{"max_samples_per_ray":1e7},)");
  ASSERT_EQ(records.size(), 6u);
  for (const CellRecord& record : records) {
    const auto output = std::find(record.outputs.begin(), record.outputs.end(), "scatter") - record.outputs.begin();
    const ChannelRecord& scatter = record.channel[static_cast<std::size_t>(output)];
    EXPECT_NEAR(*scatter.reference, scattered, 1e-12) << record.cell.name;
    EXPECT_NEAR(*scatter.mean, scattered, 5.5 * std::sqrt(0.6 / 65536)) << record.cell.name;
    EXPECT_EQ(kind_of(record), Kind::pass) << record.cell.name << ": " << record.verdict->reason;
  }
}

/// E[w^2] - 1 = int_0^1 (1 + A^2) e^-2x dx + e^-2 - 1 with A = |2x - .5| + |1.5 - 2x|: five events under a tight majorant vary.
TEST(Albedo, FiveEventsHaveTheStatedVariance) {
  const auto second = [](Real x) {
    const Real a = std::abs(2 * x - 0.5) + std::abs(1.5 - 2 * x);
    return (1 + a * a) * std::exp(-2 * x);
  };
  using Rule = boost::math::quadrature::gauss_kronrod<Real, 31>;
  const Real variance = std::exp(-2) - 1 + Rule::integrate(second, 0., 0.25) + Rule::integrate(second, 0.25, 0.75) +
                        Rule::integrate(second, 0.75, 1.);
  EXPECT_NEAR(variance, 0.340, 1e-3);
  const auto records = cells(R"({"type":"weighted_decomposition","control":"given","controls":[1],"control_albedo":[0.5]})",
                             kApart, R"("quantity":"free_path",)");
  // The medium's bound is the sum of its components' bounds, so the majorant is given.
  const auto tight = run_untimed(read_config(
      R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","rays":{"type":"single","from":[0,0.5,0.5],
      "to":[1,0.5,0.5]},"samples_per_ray":65536,"quantity":"free_path","matrix":{"estimator":{"type":"weighted_decomposition",
      "control":"given","controls":[1],"control_albedo":[0.5]},"majorant":{"type":"prescribed","value":2},"medium":)" +
          std::string(kApart) + "}}]}",
      "c.json"));
  const ChannelRecord& weight = tight.at(0).channel.back();
  EXPECT_NEAR(*weight.variance_theory, variance, 1e-9);
  EXPECT_NEAR(*weight.variance, variance, 0.02);
  EXPECT_GT(*records.at(0).channel.back().variance_theory, 0);
}

/// Below each coefficient a control leaves every weight 1, and the analog form takes it.
TEST(Albedo, BoundingControlsLeaveWeightsAlone) {
  const char* medium = R"({"type":"sum","media":[{"type":"homogeneous","extinction":1,"albedo":0},
      {"type":"homogeneous","extinction":1,"albedo":1},{"type":"linear","begin":0,"end":2,"albedo":0.5}]})";
  for (const CellRecord& record : cells(R"([{"type":"analog_decomposition","control":"given","value":1.5,"control_albedo":[0.6]},
                 {"type":"weighted_decomposition","control":"given","controls":[1.5],"control_albedo":[0.6]}])",
                                        medium, R"("quantity":"free_path","verdict":{"max_samples_per_ray":4e6},)")) {
    EXPECT_EQ(*record.channel.back().variance, 0) << record.cell.name;
    EXPECT_EQ(kind_of(record), Kind::pass) << record.cell.name << ": " << record.verdict->reason;
  }
  const auto refused = [&](const char* share) {
    return error_of(
        std::string(R"({"type":"analog_decomposition","control":"given","value":1.5,"control_albedo":[)") + share + "]}", medium);
  };
  // .6 + .9 is in, 1.05 of either is not: the minimum of the extinction alone would allow it.
  EXPECT_EQ(refused("0.6"), "no error");
  for (const char* share : {"0.7", "0.3"})
    EXPECT_NE(refused(share).find("control_albedo: its control absorbs by "), std::string::npos) << refused(share);
  for (const char* tracker : {"analog_decomposition", "weighted_decomposition"})
    EXPECT_NE(error_of("\"" + std::string(tracker) + "\"", kApart).find("the medium's albedo varies"), std::string::npos)
        << tracker;
}

/// The albedo of a field, in one channel and in several.
TEST(Albedo, FieldsAreReadAtTheCollision) {
  const auto integral = [](Real factor) {
    // mu = 3 - 2.75 x, of media/linear.h's defaults, times the factor; a = .1 + .8 x.
    return boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(
        [&](Real x) {
          const Real mu = factor * (3 - 2 * x);
          return (0.1 + 0.8 * x) * mu * std::exp(-factor * (3 * x - x * x));
        },
        0., 1.);
  };
  for (const bool chromatic : {false, true}) {
    const std::string medium = std::string(R"({"type":"linear","begin":3,"end":1,)") +
                               (chromatic ? R"("spectrum":[1,2,4],)" : "") +
                               R"("albedo":{"field":{"type":"linear","begin":0.1,"end":0.9}}})";
    for (const CellRecord& record : cells(R"(["delta","spectral","null_collision","hero_wavelength"])", medium,
                                          R"("quantity":"free_path","verdict":{"max_samples_per_ray":4e6},)")) {
      if (record.status != Status::ok) continue;
      for (int c = 0; c < record.channels; ++c) {
        const std::string name = chromatic ? "scatter/channel " + std::to_string(c) : "scatter";
        const auto output = std::find(record.outputs.begin(), record.outputs.end(), name) - record.outputs.begin();
        const ChannelRecord& scatter = record.channel[static_cast<std::size_t>(output)];
        const Real exact = integral(chromatic ? std::array{1., 2., 4.}[static_cast<std::size_t>(c)] : 1);
        EXPECT_NEAR(*scatter.reference, exact, 1e-12) << record.cell.name;
        EXPECT_NEAR(*scatter.mean, exact, 0.02) << record.cell.name;
      }
      EXPECT_NE(kind_of(record), Kind::fail) << record.cell.name << ": " << record.verdict->reason;
    }
  }
}

/// Radiance in equilibrium is that of the surroundings, whatever absorbs where.
TEST(Albedo, FurnacesStayInEquilibrium) {
  const std::string medium = std::string(kApart).insert(std::string(kApart).size() - 1, R"(,"emission":1)");
  for (const CellRecord& record : cells(
           R"(["delta","spectral",{"type":"weighted_decomposition","control":"given","controls":[0.5],"control_albedo":[0.5]}])",
           medium, R"("quantity":"radiance","transport":{"environment":1},)")) {
    EXPECT_EQ(record.status, Status::ok) << record.reason;
    EXPECT_NEAR(*record.channel[0].mean, 1, 0.05) << record.cell.name;
    EXPECT_NE(kind_of(record), Kind::fail) << record.cell.name << ": " << record.verdict->reason;
  }
  // What is emitted and never scattered: mu_a T along the ray.
  for (const CellRecord& record :
       cells(R"(["delta","spectral"])", medium, R"("quantity":"radiance","transport":{"most_scatterings":0},)"))
    EXPECT_NEAR(*record.channel[0].mean, 0.5 - 1.5 * std::exp(-2), 5.5 * std::sqrt(0.21 / 65536)) << record.cell.name;
}

/// Spectral decomposition with an average and with given controls, whose residuals may be negative.
TEST(Albedo, ChromaticControlsMayExceedTheExtinction) {
  for (const char* albedo : {R"(0.5)", R"([0.2,0.5,0.9])", R"({"field":{"type":"linear","begin":0.1,"end":0.9}})"}) {
    const std::string medium = std::string(R"({"type":"linear","begin":3,"end":1,"spectrum":[1,2,0.5],"albedo":)") + albedo + "}";
    for (const CellRecord& record :
         cells(R"([{"type":"spectral","control":"average"},{"type":"spectral","control":"given","controls":[2.5,5,1]},
                   {"type":"spectral","scheme":"maximum","control":"given","controls":[1]}])",
               medium, R"("quantity":"free_path","verdict":{"max_samples_per_ray":2e6},)")) {
      EXPECT_EQ(record.status, Status::ok) << record.reason;
      EXPECT_NE(kind_of(record), Kind::fail) << record.cell.name << ": " << record.verdict->reason;
      const auto output = std::find(record.outputs.begin(), record.outputs.end(), "scatter/channel 0") - record.outputs.begin();
      for (std::size_t c = 0; c < 3; ++c) {
        const ChannelRecord& scatter = record.channel[static_cast<std::size_t>(output) + c];
        EXPECT_NEAR(*scatter.bias, 0, 6 * std::sqrt(*scatter.variance / 65536)) << record.cell.name << " " << albedo << c;
      }
    }
  }
  EXPECT_NE(error_of(R"({"type":"spectral","control":"given","controls":[1,2]})", R"({"type":"linear","spectrum":[1,2,4]})")
                .find("has 2 numbers; control \"given\" takes one for all channels or one for each of the 3"),
            std::string::npos);
}

TEST(Albedo, ComponentsAndWholeExcludeEachOther) {
  EXPECT_NE(
      error_of("\"delta\"", R"({"type":"sum","albedo":0.5,"media":[{"type":"linear","albedo":1}]})").find("exclude each other"),
      std::string::npos);
  EXPECT_NE(error_of("\"delta\"", R"({"type":"channels","media":[{"type":"linear","albedo":1}]})").find("belongs to the whole"),
            std::string::npos);
  EXPECT_NE(error_of("\"delta\"", R"({"type":"linear","albedo":{"field":{"type":"linear","spectrum":[1,2]}}})")
                .find("found a field of 2 channels; expected one, or 1"),
            std::string::npos);
}

}  // namespace
}  // namespace nullmark
