// The committed results of configs/claims: the guide rests on them, and they come out again.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "harness/analysis/check.h"
#include "harness/config/config.h"
#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

std::string in_tree(const std::string& path) { return std::string(NULLMARK_SOURCE_DIR) + "/" + path; }

RunRecord committed() {
  const std::string file = in_tree("results/claims.json.gz");
  return read_results(read_file(file), file);
}

std::map<std::string, ClaimOutcome> outcomes(RunRecord run) {
  std::map<std::string, ClaimOutcome> result;
  for (const ClaimFinding& finding : summarise(run).findings) result[finding.claim->id] = finding.outcome;
  return result;
}

TEST(Guide, EverySentenceIsBorneOutByTheCommittedResults) {
  const RunRecord run = committed();
  const std::map<std::string, ClaimOutcome> words = outcomes(run);
  const std::string guide = read_file(in_tree("estimators/README.md"));
  std::size_t sentences = 0;
  for (const PublishedClaim& claim : run.claims) {
    if (claim.id[0] != 'G') continue;
    ++sentences;
    EXPECT_NE(guide.find(fmt::format("{} ({})", claim.claim, claim.id)), std::string::npos) << claim.id;
    EXPECT_EQ(words.at(claim.id), ClaimOutcome::reproduced) << claim.id;
  }
  EXPECT_GE(sentences, 9u);
}

TEST(Guide, TheCommittedResultsAreThoseOfTheConfigurations) {
  const Plan plan = read_configs(load_configs({in_tree("configs/claims")}));
  EXPECT_EQ(committed().config_text, Json::parse(plan.config_text).dump());
}

/// Cheap ones: the rest takes minutes.
TEST(Guide, ClaimsComeOutAgain) {
  const std::map<std::string, ClaimOutcome> before = outcomes(committed());
  for (const char* file : {"star_2018", "peters_2025", "misso_2023"}) {
    const Plan plan = read_configs(load_configs({in_tree(fmt::format("configs/claims/{}.json", file))}));
    RunRecord run;
    run.config_text = plan.config_text;
    run.claims = plan.claims;
    run.cells = run_untimed(plan);
    for (const auto& [id, outcome] : outcomes(run)) EXPECT_EQ(outcome, before.at(id)) << id;
  }
}

}  // namespace
}  // namespace nullmark
