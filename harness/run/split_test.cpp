// Cells that shards share: whatever the number of shards, their merged parts are the whole run to the last bit.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/config.h"
#include "harness/io/json_input.h"
#include "harness/io/packing.h"
#include "harness/io/results_json.h"
#include "harness/run/cell_draws.h"
#include "harness/run/deal.h"
#include "harness/run/judge_parts.h"
#include "harness/run/merge.h"
#include "harness/run/provenance.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

Plan split_plan(const std::string& experiments, int seed = 1) {
  return read_config(fmt::format(R"({{"nullmark":"config/2","name":"split","seed":{},"timing":{{"enabled":false}},
                                     "experiments":[{}]}})",
                                 seed, experiments),
                     "split.json");
}

/// One of `parts` shards that share every cell.
RunRecord shard(const Plan& plan, std::size_t part, std::size_t parts) {
  RunOptions options;
  options.timing = false;
  options.shares.assign(plan.cells.size(), CellShare{part, parts});
  const std::vector<bool> all(plan.cells.size(), true);
  return make_run_record(plan, unshared(run_plan(plan, all, {}, options, {})), {});
}

std::vector<RunRecord> shards(const Plan& plan, std::size_t parts) {
  std::vector<RunRecord> all;
  // Results as they are read from their files.
  for (std::size_t part = 0; part < parts; ++part)
    all.push_back(read_results(results_text(shard(plan, part, parts)), fmt::format("{}.json", part + 1)));
  return all;
}

std::vector<std::string> names_of(const std::vector<RunRecord>& parts) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < parts.size(); ++i) names.push_back(fmt::format("{}.json", i + 1));
  return names;
}

struct Merged {
  RunRecord run;
  std::vector<std::string> open;
};

Merged merged(const std::vector<RunRecord>& parts) {
  Merged merged{merge_results(parts, names_of(parts)), {}};
  merged.open = judge_parts(merged.run, "merged.json", "");
  return merged;
}

std::string refusal(const std::vector<RunRecord>& parts) {
  try {
    merged(parts);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string whole(const Plan& plan) { return statistics_text(make_run_record(plan, run_untimed(plan), {})); }

struct Example {
  const char *name, *experiment;
};

constexpr Example kExamples[] = {
    {"grey", R"({"name":"grey","rays":{"type":"orthographic","width":7,"height":5},"samples_per_ray":1024,
        "matrix":{"estimator":["ratio","delta"],"medium":{"type":"cosine","optical_depth":2}}})"},
    {"one ray in chunks", R"({"name":"deep","rays":{"type":"single"},"samples_per_ray":70001,
        "matrix":{"estimator":["ratio","next_flight_ratio"],"medium":{"type":"linear","optical_depth":1}}})"},
    {"chromatic", R"({"name":"colours","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":512,
        "matrix":{"estimator":["spectral","ratio"],
                  "medium":{"type":"homogeneous","extinction":0.5,"spectrum":[1,2,4]}}})"},
    {"radiance with a pilot", R"({"name":"furnace","rays":{"type":"chords","count":8},"quantity":"radiance",
        "samples_per_ray":1024,
        "verdict":{"epsilon":0.02,"max_samples_per_ray":20000,"laws":"never"},
        "matrix":{"estimator":["delta","weighted_decomposition"],
                  "medium":{"type":"gaussian_bump","optical_depth":1,"albedo":1,"anisotropy":0.5},
                  "transport":{"environment":1,"next_event":"mis"}}})"},
    {"own mean", R"({"name":"marched","rays":{"type":"chords","count":16},"samples_per_ray":2048,
        "matrix":{"estimator":["ray_marching","jackknife"],"medium":{"type":"cosine","optical_depth":2}}})"},
    {"exact", R"({"name":"exact","rays":{"type":"chords","count":9},"samples_per_ray":4,
        "matrix":{"estimator":"regular","medium":{"type":"linear","optical_depth":2}}})"},
    {"laws", R"({"name":"laws","rays":{"type":"chords","count":8},"samples_per_ray":256,"verdict":{"laws":"always"},
        "matrix":{"estimator":["ratio","delta","ratio_roulette"],"medium":{"type":"cosine","optical_depth":6}}})"},
    {"free paths", R"({"name":"flights","rays":{"type":"chords","count":8},"quantity":"free_path","samples_per_ray":512,
        "matrix":{"estimator":["delta","weighted_decomposition"],"medium":{"type":"cosine","optical_depth":2,"albedo":0.5}}})"},
    {"equal lookups", R"({"name":"equal","rays":{"type":"chords","count":8},"equal_lookups":5000,
        "matrix":{"estimator":["ratio","delta"],"medium":{"type":"cosine","optical_depth":2}}})"},
    {"difference", R"({"name":"pair","rays":{"type":"chords","count":8},"samples_per_ray":512,"minus":"delta",
        "matrix":{"estimator":"ratio","medium":{"type":"cosine","optical_depth":1}}})"},
    {"violated", R"({"name":"violated","rays":{"type":"chords","count":8},"samples_per_ray":512,
        "matrix":{"estimator":["ratio","delta"],"medium":{"type":"cosine","optical_depth":2},
                  "majorant":{"type":"global","looseness":0.3}}})"},
    {"FAIL", R"({"name":"wrong","rays":{"type":"chords","count":8},"samples_per_ray":1024,
        "matrix":{"estimator":["planted_zero","planted_clamped_ratio"],"medium":{"type":"cosine","optical_depth":1}}})"},
    {"told the depth", R"({"name":"told","rays":{"type":"chords","count":8},"samples_per_ray":512,
        "matrix":{"estimator":["jackknife_normal","ratio"],"medium":{"type":"cosine","optical_depth":2}}})"},
};

TEST(SplitCells, MergedPartsAreTheWholeRunToTheLastBit) {
  for (const Example& example : kExamples) {
    SCOPED_TRACE(example.name);
    const Plan plan = split_plan(example.experiment);
    const std::string expected = whole(plan);
    for (const std::size_t parts : {2, 3, 16}) {
      SCOPED_TRACE(parts);
      const Merged all = merged(shards(plan, parts));
      EXPECT_EQ(all.open, std::vector<std::string>());
      EXPECT_EQ(statistics_text(all.run), expected);
    }
  }
}

const Plan& grey() {
  static const Plan plan = split_plan(kExamples[0].experiment);
  return plan;
}

TEST(SplitCells, ALonePartIsNoVerdict) {
  const RunRecord part = shard(grey(), 1, 3);
  for (const CellRecord& record : part.cells) {
    EXPECT_EQ(record.status, Status::not_run);
    EXPECT_EQ(record.part, "2/3");
    EXPECT_EQ(record.drawn_parts.size(), 1u);
    EXPECT_FALSE(record.verdict);
    EXPECT_EQ(record.reason, "part 2/3 of the cell is drawn; `merge` joins the parts");
    EXPECT_TRUE(has_samples(record));
    EXPECT_TRUE(is_kept(record, {1, 3})) << "by the same shard";
    EXPECT_TRUE(is_kept(record, {})) << "by a run of the whole cell";
    EXPECT_FALSE(is_kept(record, {0, 3}));
    EXPECT_FALSE(is_kept(record, {1, 2}));
    CellRecord elsewhere = record;
    elsewhere.build = "another compiler";
    EXPECT_FALSE(is_kept(elsewhere, {1, 3}));
  }
}

/// Whichever part is missing, the cell stays open; a run takes what is there, draws the rest and has the whole run's bits.
TEST(SplitCells, WhatIsMissingIsDrawnLater) {
  const std::vector<RunRecord> all = shards(grey(), 3);
  for (std::size_t missing = 0; missing < all.size(); ++missing) {
    std::vector<RunRecord> some = all;
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(missing));
    const Merged part = merged(some);
    EXPECT_EQ(part.open.size(), grey().cells.size());
    for (const CellRecord& record : part.run.cells) {
      EXPECT_EQ(record.status, Status::not_run);
      EXPECT_NE(record.reason.find(missing == 0 ? "first part of the cell is missing" : " are not drawn"), std::string::npos)
          << record.reason;
    }
    RunOptions options;
    options.timing = false;
    const std::vector<bool> everything(grey().cells.size(), true);
    const RunRecord later = make_run_record(grey(), unshared(run_plan(grey(), everything, part.run.cells, options, {})), {});
    EXPECT_EQ(statistics_text(later), whole(grey()));
    // Parts of parts are joined as well.
    EXPECT_EQ(statistics_text(merged({part.run, all[missing]}).run), whole(grey()));
  }
}

/// A verdict that is open where an unbiased cell would be decided asks for samples that no shard draws.
TEST(SplitCells, AVerdictMayAskForMoreThanIsDrawn) {
  // The spans of several seeds: in some the planned samples do not suffice.
  std::size_t open = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    const Plan plan = split_plan(R"({"name":"more","rays":{"type":"single"},"samples_per_ray":1024,
        "verdict":{"epsilon":0.02,"max_samples_per_ray":1000000,"laws":"never"},
        "matrix":{"estimator":["delta","ratio"],"medium":{"type":"linear","optical_depth":1}}})",
                                 seed);
    const Merged part = merged(shards(plan, 2));
    open += part.open.size();
    for (const CellRecord& record : part.run.cells) {
      if (record.status == Status::ok) continue;
      EXPECT_NE(record.reason.find("are wanted and not drawn; `run CONFIG --resume -o RESULTS`"), std::string::npos) << record.reason;
    }
    RunOptions options;
    options.timing = false;
    const std::vector<bool> everything(plan.cells.size(), true);
    EXPECT_EQ(statistics_text(make_run_record(plan, unshared(run_plan(plan, everything, part.run.cells, options, {})), {})),
              whole(plan));
  }
  EXPECT_GT(open, 0u);
  EXPECT_LT(open, 20u);
}

TEST(SplitCells, OnlyTheSamplesThatAreMissingAreDrawnLater) {
  std::vector<RunRecord> some = shards(grey(), 3);
  some.pop_back();
  // What is stored is used: a change of it shows.
  RunRecord part = merged(some).run;
  CellDraws draws = read_draws(part.cells[0].drawn_parts[0], "part");
  draws.spans.begin()->second.portions.begin()->second.counters.lookups += 1000000;
  part.cells[0].drawn_parts[0] = draws_text(draws);
  RunOptions options;
  options.timing = false;
  const auto later = unshared(run_plan(grey(), std::vector<bool>(grey().cells.size(), true), part.cells, options, {}));
  const std::vector<CellRecord> plain = run_untimed(grey());
  EXPECT_EQ(later[0].lookups, plain[0].lookups + 1000000);
  EXPECT_EQ(later[1].lookups, plain[1].lookups);
}

TEST(SplitCells, DamagedAndForeignPartsAreRefused) {
  const std::vector<RunRecord> good = shards(grey(), 2);
  const std::string cell = "2.json: cell \"" + good[0].cells[0].cell.name + "\": ";
  const auto with = [&](const auto& change) {
    std::vector<RunRecord> parts = good;
    change(parts[1].cells[0].drawn_parts[0]);
    return refusal(parts);
  };
  const std::string damaged = cell + "found drawn samples that are damaged; expected what the shard wrote: run the shard again";
  EXPECT_EQ(with([](std::string& text) { text.resize(text.size() / 2 / 4 * 4); }), damaged);
  EXPECT_EQ(with([](std::string& text) { std::swap(text[text.size() / 2], text[text.size() / 3]); }), damaged);
  EXPECT_EQ(with([](std::string& text) { text = "!!"; }), damaged);
  EXPECT_EQ(with([](std::string& text) { text.clear(); }), damaged);
  // Sound as a gzip file, with fewer or more bytes than were written.
  for (const int more : {-1, 1})
    EXPECT_EQ(with([&](std::string& text) {
                std::string bytes = *unpacked(text, std::size_t{1} << 30);
                bytes.resize(bytes.size() + static_cast<std::size_t>(more));
                text = packed(bytes);
              }),
              damaged);
  EXPECT_EQ(with([&](std::string& text) { text = good[1].cells[1].drawn_parts[0]; }),
            cell + "found samples of another cell; run the shard again");
  const auto edited = [&](const auto& change) {
    return with([&](std::string& text) {
      CellDraws draws = read_draws(text, "part");
      change(draws);
      text = draws_text(draws);
    });
  };
  EXPECT_NE(edited([](CellDraws& draws) { draws.plan ^= 1; }).find("drawn for other tests"), std::string::npos);
  EXPECT_NE(edited([](CellDraws& draws) { draws.spans.begin()->second.per_ray += 1; }).find("in other steps"), std::string::npos);
  EXPECT_NE(edited([](CellDraws& draws) {
              draws.spans.begin()->second.portions.begin()->second.moments.pop_back();
            }).find("of another shape"),
            std::string::npos);
  EXPECT_NE(edited([](CellDraws& draws) {
              auto& portions = draws.spans.begin()->second.portions;
              portions[0] = portions.begin()->second;
            }).find("other samples than in another part"),
            std::string::npos);
}

/// Parts that agree with each other, and not with what is planned where they are merged.
TEST(SplitCells, PartsOfOtherTestsAreRefused) {
  std::vector<RunRecord> parts = shards(grey(), 2);
  for (RunRecord& part : parts) {
    CellDraws draws = read_draws(part.cells[0].drawn_parts[0], "part");
    draws.plan ^= 1;
    part.cells[0].drawn_parts[0] = draws_text(draws);
  }
  EXPECT_EQ(refusal(parts), "cell \"" + parts[0].cells[0].cell.name +
                                "\": found samples drawn for other tests than are planned here; run its shards again");
}

/// The same part twice, or parts of two dealings, are no contradiction.
TEST(SplitCells, PartsMayOverlap) {
  std::vector<RunRecord> parts = shards(grey(), 2);
  parts.push_back(parts[0]);
  parts.push_back(shard(grey(), 1, 3));
  EXPECT_EQ(statistics_text(merged(parts).run), whole(grey()));
}

TEST(SplitCells, PartsOfAnotherSeedAreRefused) {
  const Plan other = split_plan(kExamples[0].experiment, 2);
  EXPECT_NE(refusal({shard(grey(), 0, 2), shard(other, 1, 2)}).find("/seed: found 2, and 1 in 1.json;"), std::string::npos);
}

/// Any costs are dealt evenly: each cell once, or each of its parts once, to different shards.
TEST(Deals, LoadsAreEven) {
  constexpr double kMost = 1.1;
  for (const std::size_t shards : {2u, 3u, 16u, 64u}) {
    std::vector<std::optional<CellCost>> costs;
    double total = 0;
    for (std::size_t i = 0; i < 400; ++i) {
      // From hardly anything to most of it.
      const double cost = 1e6 * std::pow(1.05, static_cast<double>(i * 7919 % 400));
      costs.push_back(CellCost{cost, cost / 1000, cost / 100, 4096});
      total += cost;
    }
    total -= costs[5]->spread;
    costs[5].reset();
    const Deal dealt = deal_costs(costs, shards);
    EXPECT_TRUE(dealt.shard_of[5].empty());
    double sum = 0;
    for (const double load : dealt.loads) {
      sum += load;
      EXPECT_LE(load, kMost * total / static_cast<double>(shards));
    }
    EXPECT_GE(sum, total);
    for (std::size_t i = 0; i < costs.size(); ++i) {
      std::vector<std::size_t> of_cell = dealt.shard_of[i];
      std::sort(of_cell.begin(), of_cell.end());
      EXPECT_EQ(std::adjacent_find(of_cell.begin(), of_cell.end()), of_cell.end());
      std::size_t held = 0;
      for (std::size_t shard = 0; shard < shards; ++shard) {
        if (!dealt.cells_of(shard)[i]) continue;
        ++held;
        EXPECT_EQ(dealt.shares_of(shard)[i].parts, of_cell.size());
      }
      EXPECT_EQ(held, of_cell.size());
    }
  }
}

/// What the forecast says is what is drawn: lookups of the shards of a configuration whose largest cell is most of it.
TEST(Deals, ShardsDrawEqualCounts) {
  const Plan plan = split_plan(R"({"name":"large","rays":{"type":"orthographic","width":64,"height":64},"samples_per_ray":256,
        "matrix":{"estimator":"ratio","medium":{"type":"cosine","optical_depth":4}}},
      {"name":"small","rays":{"type":"chords","count":8},"samples_per_ray":512,
        "matrix":{"estimator":["ratio","delta","next_flight_ratio"],"medium":{"type":"cosine","optical_depth":[0.5,1,2,4]}}})");
  constexpr std::size_t kShards = 4;
  const std::vector<bool> all(plan.cells.size(), true);
  const Deal dealt = deal(plan, all, kShards);
  EXPECT_EQ(deal(plan, all, kShards).shard_of, dealt.shard_of) << "the same for every shard";
  EXPECT_EQ(dealt.shard_of[0].size(), kShards);
  std::vector<RunRecord> parts;
  std::vector<double> lookups;
  for (std::size_t i = 0; i < kShards; ++i) {
    RunOptions options;
    options.timing = false;
    options.shares = dealt.shares_of(i);
    parts.push_back(make_run_record(plan, unshared(run_plan(plan, dealt.cells_of(i), {}, options, {})), {}));
    lookups.push_back(0);
    for (const CellRecord& record : parts.back().cells) {
      lookups.back() += static_cast<double>(record.lookups);
      for (const std::string& text : record.drawn_parts)
        for (const auto& [first, span] : read_draws(text, "part").spans)
          for (const auto& [number, portion] : span.portions) lookups.back() += static_cast<double>(portion.counters.lookups);
    }
  }
  const double mean = std::accumulate(lookups.begin(), lookups.end(), 0.) / static_cast<double>(kShards);
  EXPECT_LT(*std::max_element(lookups.begin(), lookups.end()), 1.2 * mean);
  EXPECT_EQ(statistics_text(merged(parts).run), whole(plan));
}

}  // namespace
}  // namespace nullmark
