// The committed results of configs/claims: the guide rests on them, and they come out again.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <string>

#include "harness/analysis/check.h"
#include "harness/config/config.h"
#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/model/metrics.h"
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

/// Whether a file, a claim or a test of that name exists.
bool exists(const std::string& name, const std::map<std::string, ClaimOutcome>& claims, const std::string& tests) {
  if (name.find('/') != std::string::npos) return std::filesystem::exists(in_tree(name));
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos) return claims.contains(name);
  return tests.find(fmt::format("({}, {})", name.substr(0, dot), name.substr(dot + 1))) != std::string::npos;
}

TEST(Guide, EveryRowOfTheSeedsNamesWhatShowsIt) {
  std::map<std::string, ClaimOutcome> claims;
  std::string tests;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(in_tree("configs"))) {
    if (entry.path().extension() != ".json") continue;
    const Json config = Json::parse(read_file(entry.path()));
    if (const auto list = config.find("claims"); list != config.end())
      for (const Json& claim : *list) claims[claim.at("id")] = {};
  }
  for (const char* folder : {"media", "estimators", "harness"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(in_tree(folder)))
      if (entry.path().string().ends_with("_test.cpp")) tests += read_file(entry.path());
  std::map<std::string, int> rows;
  const std::string table = read_file(in_tree("configs/seeds.md"));
  const std::regex row(R"(\| (\d+) \| [^|\n]+ \| (works|partly|missing) \| ([^|\n]+) \|)"), name("`([^`]+)`");
  for (std::sregex_iterator i(table.begin(), table.end(), row), end; i != end; ++i) {
    const std::string where = (*i)[3];
    EXPECT_EQ(++rows["all"], std::stoi((*i)[1]));
    ++rows[(*i)[2]];
    std::sregex_iterator named(where.begin(), where.end(), name);
    EXPECT_TRUE((*i)[2] == "missing" || named != end) << (*i)[0];
    for (; named != end; ++named) EXPECT_TRUE(exists((*named)[1], claims, tests)) << (*i)[0] << ": " << (*named)[1];
  }
  EXPECT_NE(table.find(fmt::format("Of {} rows, {} work, {} work partly and {} are missing.", rows["all"], rows["works"],
                                   rows["partly"], rows["missing"])),
            std::string::npos);
  EXPECT_EQ(rows["all"], 83);
}

TEST(Guide, TheCommittedResultsAreThoseOfTheConfigurations) {
  const Plan plan = read_configs(load_configs({in_tree("configs/claims")}));
  EXPECT_EQ(committed().config_text, Json::parse(plan.config_text).dump());
}

/// A figure of both kernels, own / general, with three digits.
std::string both(const std::vector<const CellRecord*>& kernels, const char* name) {
  std::vector<std::string> texts;
  for (const CellRecord* record : kernels) {
    const Real value = metric(*record, name).value();
    texts.push_back(fmt::format("{:.{}f}", value, value >= 100 ? 0 : value >= 10 ? 1 : 2));
  }
  return fmt::format("{}", fmt::join(texts, " / "));
}

/// `scripts/reference effects` makes the results; this test prints the rows that the page lacks.
TEST(Guide, TheTableOfEffectsIsThatOfTheCommittedResults) {
  const std::string file = in_tree("results/effects.json.gz"), page = read_file(in_tree("harness/kernel/light.md"));
  const RunRecord run = read_results(read_file(file), file);
  std::map<std::string, std::vector<const CellRecord*>> kernels;  // own, general
  for (const CellRecord& record : run.cells) {
    auto& pair = kernels[record.cell.experiment];
    pair.insert(record.cell.transport.general ? pair.end() : pair.begin(), &record);
  }
  for (const auto& [experiment, pair] : kernels) {
    const std::string row =
        fmt::format("| `{}` | {} | {} | {} | {} |", experiment, both(pair, "ns_per_sample"), both(pair, "variance_x_ns"),
                    both(pair, "lookups_per_sample"), both(pair, "draws_per_sample"));
    EXPECT_NE(page.find(row), std::string::npos) << row;
  }
  EXPECT_EQ(kernels.size(), 10u);
  const Plan plan = read_configs(load_configs({in_tree("configs/effects.json")}));
  EXPECT_EQ(run.config_text, Json::parse(plan.config_text).dump());
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
