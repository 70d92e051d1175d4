#include "harness/config/config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "harness/config/axes.h"
#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/spec_json.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

/// A configuration of one experiment with the given keys beside a name, rays and sample count.
std::string experiment(const std::string& keys) {
  return R"({"nullmark":"config/2","name":"t","experiments":[{"name":"e","rays":"single","samples_per_ray":10,)" + keys + "}]}";
}

Plan plan_of(const std::string& keys) { return read_config(experiment(keys), "t.json"); }

std::vector<std::string> names(const Plan& plan) {
  std::vector<std::string> result;
  for (const Cell& cell : plan.cells) result.push_back(cell.name);
  return result;
}

std::string error_of(const std::string& text) {
  try {
    read_config(text, "t.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

using Names = std::vector<std::string>;

TEST(Config, EveryKeyOfAnExperimentIsInTheGuide) {
  const std::string guide = read_file(NULLMARK_SOURCE_DIR "/harness/config/config.md");
  const std::size_t begin = guide.find("Its keys are "), end = guide.find("**Names and ids.**");
  ASSERT_TRUE(begin < end && end < guide.size());
  const std::string text = guide.substr(begin, end - begin), of_matrix = text.substr(0, text.find("Each can instead"));
  for (const std::string& name : axis_names()) EXPECT_NE(of_matrix.find("`" + name + "`"), std::string::npos) << name;
  for (const SharedKey& key : shared_keys()) EXPECT_NE(text.find("\n| `" + key.name + "` | "), std::string::npos) << key.name;
}

TEST(Config, CrossesAxesAndSweptParametersFirstKeySlowest) {
  const Plan plan = plan_of(
      R"("matrix":{"estimator":["ratio",{"type":"residual_ratio","control":["minimum","average"]}],"medium":{"type":"linear","end":[1,2]}})");
  EXPECT_EQ(names(plan), (Names{"ratio/linear/global", "ratio/linear/end:2/global", "residual_ratio/linear/global",
                                "residual_ratio/linear/end:2/global", "residual_ratio/control:average/linear/global",
                                "residual_ratio/control:average/linear/end:2/global"}));
  EXPECT_EQ(plan.media.size(), 2u);
  EXPECT_EQ(plan.majorants.size(), 1u);
}

TEST(Config, ListParametersAreSweptByListsOfLists) {
  const Plan plan = plan_of(
      R"("matrix":{"estimator":"ratio","medium":[{"type":"layers","values":[1,2,3]},{"type":"layers","values":[[1,2],[3]],"lo":[[0,0,0],[-1,0,0]]}]})");
  EXPECT_EQ(names(plan), (Names{"ratio/layers/values:1,2,3/global", "ratio/layers/values:1,2/global",
                                "ratio/layers/values:1,2/lo:-1,0,0/global", "ratio/layers/values:3/global",
                                "ratio/layers/values:3/lo:-1,0,0/global"}));
}

TEST(Config, SpectraAndChannels) {
  const Plan plan = plan_of(R"("matrix":{"estimator":"ratio","medium":[{"type":"linear","spectrum":[[1,2],[3,4,5]]},)"
                            R"({"type":"channels","optional":true,"media":["homogeneous",{"type":"linear","end":[3,4]}]}]})");
  ASSERT_EQ(names(plan),
            (Names{"ratio/linear/spectrum:1,2/global", "ratio/linear/spectrum:3,4,5/global",
                   "ratio/channels(homogeneous|linear/end:3)/global", "ratio/channels(homogeneous|linear/end:4)/global"}));
  EXPECT_EQ(plan.media[1]->spectrum, (std::vector<Real>{3, 4, 5}));
  EXPECT_EQ(plan.media[3]->per_channel.size(), 2u);
  EXPECT_TRUE(plan.media[3]->optional);
}

TEST(Config, ZipAdvancesTogether) {
  const std::string media = R"("matrix":{"medium":[{"type":"linear","end":[1,2,3]}],"estimator":["ratio","delta"],)";
  const Plan plan = plan_of(media + R"("majorant":{"type":"prescribed","value":[1,2,3]}},"zip":[["medium","majorant"]])");
  EXPECT_EQ(plan.cells.size(), 6u);
  for (const Cell& cell : plan.cells)
    EXPECT_EQ(plan.media[cell.medium]->field.values.at("end"), plan.majorants[cell.majorant]->values.at("value"));
  EXPECT_EQ(error_of(experiment(media + R"("majorant":["global"]},"zip":[["medium","majorant"]])")),
            "t.json: /experiments/0/matrix/majorant: found 1 values; expected 3, as many as \"medium\" it is zipped with");
}

TEST(Config, ExcludeConstraintsAndInclude) {
  const Plan plan = plan_of(
      R"("matrix":{"estimator":["ratio","delta","residual_ratio"],"medium":["linear","homogeneous"],"majorant":["global",{"type":"grid","resolution":[4,8]}]},)"
      R"("exclude":[{"estimator":"ratio","medium":"homogeneous"},{"majorant":{"type":"grid","resolution":4}}],)"
      R"("constraints":[{"if":{"estimator":["delta","residual_ratio"]},"then":{"majorant":"global"}}],)"
      R"("include":[{"estimator":"delta","medium":{"type":"homogeneous","extinction":3},"samples_per_ray":7,"seed":9}])");
  EXPECT_EQ(names(plan), (Names{"ratio/linear/global", "ratio/linear/grid/resolution:8", "delta/linear/global",
                                "delta/homogeneous/global", "residual_ratio/linear/global", "residual_ratio/homogeneous/global",
                                "delta/homogeneous/extinction:3/global"}));
  EXPECT_EQ(plan.cells.back().samples_per_ray, 7u);
  EXPECT_EQ(plan.cells.back().seed, 9u);
  EXPECT_EQ(plan.cells.front().samples_per_ray, 10u);
}

TEST(Config, NamesAreUniqueAndSayWhatDiffers) {
  const Plan plan = read_config(R"({"nullmark":"config/2","experiments":[
    {"name":"a","rays":"single","samples_per_ray":10,"matrix":{"estimator":["ratio","delta"],"medium":"linear","seed":[1,2]}},
    {"name":"b","rays":"single","samples_per_ray":20,"matrix":{"estimator":["ratio"],"medium":"linear"}}]})",
                                "t.json");
  EXPECT_EQ(names(plan), (Names{"a/ratio/linear/global/seed:1", "a/ratio/linear/global/seed:2", "a/delta/linear/global/seed:1",
                                "a/delta/linear/global/seed:2", "b/ratio/linear/global"}));
  EXPECT_EQ(plan.name, "t");
}

TEST(Config, IdsTellAllThatDecidesTheStatisticsAndNothingElse) {
  const std::string cell = R"("matrix":{"estimator":"residual_ratio","medium":"linear"})";
  std::set<std::string> ids;
  const std::vector<std::string> different = {
      cell,
      R"("matrix":{"estimator":"ratio","medium":"linear"})",
      R"("matrix":{"estimator":{"type":"residual_ratio","control":"average"},"medium":"linear"})",
      R"("matrix":{"estimator":"residual_ratio","medium":{"type":"linear","spectrum":[1]}})",
      R"("matrix":{"estimator":"residual_ratio","medium":{"type":"linear","end":1.0000000000000002}})",
      R"("matrix":{"estimator":"residual_ratio","medium":"linear","majorant":"grid"})",
      cell + R"(,"seed":2)",
      cell + R"(,"quantity":"optical_depth")",
      cell + R"(,"own_streams":true)",
      cell + R"(,"measurement":{"clamp":true})",
      cell + R"(,"measurement":{"quantise_bits":8})"};
  for (const std::string& keys : different) ids.insert(plan_of(keys).cells.at(0).id);
  EXPECT_EQ(ids.size(), different.size());
  for (
      const std::string& keys :
      {cell + R"(,"images":true,"image_maximum":2)",
       std::string(
           R"("matrix":{"medium":{"end":1,"type":"linear","optional":true},"estimator":[{"type":"residual_ratio","control":"minimum"}]})")})
    EXPECT_EQ(plan_of(keys).cells.at(0).id, plan_of(cell).cells.at(0).id);
}

TEST(Config, AppliedConfigurationGivesTheSamePlan) {
  const Plan plan = read_config(
      R"({"nullmark":"config/2","name":"round","seed":18446744073709551615,"timing":{"seconds":0.1},"experiments":[
    {"name":"a","rays":{"type":"orthographic","width":4,"height":3},"equal_lookups":100.5,"images":true,"own_streams":true,
     "measurement":{"clamp":true,"quantise_bits":8},"matrix":{"estimator":["ratio",{"type":"residual_ratio","value":0.1}],
     "medium":[{"type":"linear","spectrum":[0.1,2],"optional":true},{"type":"channels","media":["linear","homogeneous"]}]}}],
    "tables":[{"title":"T","metric":"variance","rows":[{"label":"R","given":{"p":0.25},"note":"n",
     "cells":{"c":{"experiment":"a","estimator":"ratio","medium":"channels"}},"theory":{"estimator":"ratio","medium":{"type":"linear"}}}]}]})",
      "t.json");
  ASSERT_EQ(plan.cells.size(), 4u);
  EXPECT_EQ(plan.cells[0].seed, 18446744073709551615u);
  EXPECT_EQ(plan.cells[0].equal_lookups, 100.5);
  EXPECT_EQ(plan.tables[0].rows[0].cells[0].second, "ratio/channels(linear|homogeneous)/global");
  EXPECT_EQ(plan.tables[0].rows[0].theory_of, "ratio/linear/spectrum:0.1,2/global");
  const Plan again = read_config(plan.config_text, "applied.json");
  EXPECT_EQ(again.config_text, plan.config_text);
  ASSERT_EQ(names(again), names(plan));
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    EXPECT_EQ(again.cells[i].id, plan.cells[i].id);
    EXPECT_TRUE(again.cells[i].images);
  }
  EXPECT_EQ(again.media, plan.media);
  EXPECT_TRUE(again.media[0]->optional);
  EXPECT_EQ(again.timing.seconds, 0.1);
}

TEST(Config, SeveralFilesKeepExperimentsApart) {
  const auto source = [](const std::string& name, const std::string& more = "") {
    return ConfigSource{
        R"({"nullmark":"config/2","name":")" + name + "\"" + more +
            R"(,"experiments":[{"name":"e","rays":"single","samples_per_ray":10,"matrix":{"estimator":"ratio","medium":"linear"}}],
        "tables":[{"title":"T","rows":[{"label":"R","cells":{"c":{"experiment":"e"}}}]}]})",
        name + ".json"};
  };
  const Plan plan = read_configs({source("a"), source("b")});
  EXPECT_EQ(names(plan), (Names{"a.e/ratio/linear/global", "b.e/ratio/linear/global"}));
  EXPECT_EQ(plan.tables[1].rows[0].cells[0].second, "b.e/ratio/linear/global");
  EXPECT_THROW(read_configs({source("a"), source("b", R"(,"timing":{"enabled":false})")}), InputError);
  EXPECT_THROW(read_configs({source("a"), source("a")}), InputError);
}

TEST(Config, SeedOnTheCommandLineReplacesTheFilesOwn) {
  const std::string text = experiment(R"("matrix":{"estimator":"ratio","medium":"linear"})");
  EXPECT_EQ(read_config(text, "t.json").cells[0].seed, 1u);
  EXPECT_EQ(read_config(text, "t.json", 7).cells[0].seed, 7u);
}

TEST(Config, ErrorsAreOneLineWithPlaceAndRemedy) {
  const std::string head = R"({"nullmark":"config/2",)";
  const auto matrix = [](const std::string& estimator, const std::string& medium, const std::string& more = "") {
    return experiment(R"("matrix":{"estimator":)" + estimator + R"(,"medium":)" + medium + more + "}");
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {matrix(R"(["ratio","ratoi"])", R"("linear")"),
       R"(t.json: /experiments/0/matrix/estimator/1: unknown estimator "ratoi"; did you mean "ratio"?)"},
      {matrix(R"({"type":"ratio","control":"average"})", R"("linear")"),
       R"(t.json: /experiments/0/matrix/estimator/control: unknown parameter "control"; ratio has no parameters)"},
      {matrix(R"({"type":"residual_ratio","contrl":"average"})", R"("linear")"),
       R"(t.json: /experiments/0/matrix/estimator/contrl: unknown parameter of residual_ratio "contrl"; did you mean "control"?)"},
      {matrix(R"("ratio")", R"({"type":"fractal_noise","optical_depth":2})"),
       R"(t.json: /experiments/0/matrix/medium/optical_depth: fractal_noise has no optical_depth; its extinction is set by "peak")"},
      {matrix(R"({"type":"residual_ratio","control":["minimum","averge"]})", R"("linear")"),
       R"(t.json: /experiments/0/matrix/estimator/control/1: unknown control "averge"; did you mean "average"?)"},
      {matrix(R"("ratio")", R"({"type":"linear","end":-1})"),
       R"(t.json: /experiments/0/matrix/medium/end: found -1; expected a finite number >= 0 in 1/length)"},
      {matrix(R"("ratio")", R"({"type":"linear","end":"1"})"),
       R"(t.json: /experiments/0/matrix/medium/end: found "1"; expected a finite number >= 0 in 1/length)"},
      {matrix(R"("ratio")", R"("linear")", R"(,"majorant":[{"type":"prescribed","value":-5}])"),
       R"(t.json: /experiments/0/matrix/majorant/0/value: found -5; expected a finite number >= 0 in 1/length)"},
      {matrix(R"("ratio")", R"("linear")", R"(,"majorant":{"type":"grid","resolution":1.5})"),
       R"(t.json: /experiments/0/matrix/majorant/resolution: found 1.5; expected a whole number from 1 to 512)"},
      {matrix(R"("ratio")", R"({"type":"linear","lo":[0,0]})"),
       R"(t.json: /experiments/0/matrix/medium/lo: found [0,0]; expected a list of 3 numbers)"},
      {matrix(R"([])", R"("linear")"), R"(t.json: /experiments/0/matrix/estimator: found []; expected at least one value)"},
      {matrix(R"("ratio")", R"("linear")", R"(,"samples":[1])"),
       R"(t.json: /experiments/0/matrix/samples: unknown key "samples"; expected one of "estimator", "minus", "medium", "majorant", "rays", "quantity", "samples_per_ray", "equal_lookups", "seed", "measurement", "transport", "precision", "lanes")"},
      {matrix(R"("ratio")", R"("linear")", R"(,"samples_per_ray":[10])"),
       R"(t.json: /experiments/0/samples_per_ray: found here and in "matrix"; expected one of the two)"},
      {experiment(R"("matrix":{"estimator":"ratio","medium":"linear"},"qantity":"transmittance")"),
       R"(t.json: /experiments/0/qantity: unknown key "qantity"; did you mean "quantity"?)"},
      {head +
           R"("experiments":[{"name":"e","rays":"single","samples_per_ray":0,"matrix":{"estimator":"ratio","medium":"linear"}}]})",
       R"(t.json: /experiments/0/samples_per_ray: found 0; expected a whole number from 1 to 9007199254740992)"},
      {head + R"("experiments":[{"name":"e","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":"linear"}}]})",
       R"(t.json: /experiments/0: "rays" is missing; expected it here or in "matrix")"},
      {R"({"name":"x"})", R"(t.json: /: expected the key "nullmark": "config/2")"},
      {R"({"nullmark":"config/3"})", R"(t.json: /nullmark: found "config/3"; expected "config/2")"},
      {R"({"$schema":"nullmark/config/1"})",
       R"(t.json: /$schema: version 1 is no longer read; rename "gate" to "verdict", and "verdict" at the top to "error_rates"; and replace this key by "nullmark": "config/2")"},
      {R"({"nullmark":"config/1"})",
       R"(t.json: /nullmark: version 1 is no longer read; rename "gate" to "verdict", and "verdict" at the top to "error_rates"; and write "config/2")"},
      {R"({"nullmark":"config/2","verdict":{"alpha":0.1}})", R"(t.json: /verdict: is called "error_rates" since config/2)"},
      {head + R"("experiments":[{"name":"e","gate":{"enabled":false}}]})",
       R"(t.json: /experiments/0/gate: is called "verdict" since config/2)"},
      {"{\"nullmark\": \"config/2\",\n  \"name\": \"a\",\n  \"na\\u006de\": \"b\"}",
       "t.json:3:3: key \"name\" occurs twice in this object"},
      {"{\"nullmark\": \"config/2\",\n  \"seed\": 01}",
       "t.json:2:12: syntax error while parsing object - unexpected number literal; expected '}'"},
      {R"({"nullmark": "config/2",})",
       "t.json:1:25: syntax error while parsing object key - unexpected '}'; expected string literal; remove the comma before "
       "it"},
      {R"({"nullmark": "config/2", // grey
 "seed": 1})",
       "t.json:1:26: syntax error while parsing object key - invalid literal; last read: '\"config/2\", /'; expected string "
       "literal; "
       "JSON has no comments"},
      {experiment(R"("matrix":{"estimator":"ratio","medium":"linear"},"exclude":[{"estimator":"ratio"}])"),
       R"(t.json: /experiments/0: found no cell after "exclude" and "constraints"; expected at least one)"}};
  for (const auto& [text, message] : cases) EXPECT_EQ(error_of(text), message);
}

TEST(Config, SelectorsMatchExactlyOneCell) {
  const auto with_selector = [](const std::string& selector) {
    return R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":["ratio","delta"],"medium":"linear"}}],
      "tables":[{"title":"T","rows":[{"label":"R","cells":{"c":)" +
           selector + "}}]}]}";
  };
  EXPECT_EQ(error_of(with_selector(R"({"experiment":"e","estimator":"ratio"})")), "no error");
  EXPECT_EQ(
      error_of(with_selector(R"({"experiment":"e"})")),
      "t.json: /tables/0/rows/0/cells/c: matches 2 cells, among them \"e: ratio/linear/global\" and \"e: delta/linear/global\"; "
      "expected exactly one");
  EXPECT_EQ(error_of(with_selector(R"({"estimator":"residual_ratio"})")),
            "t.json: /tables/0/rows/0/cells/c: matches no cell; expected exactly one, and no cell has this \"estimator\"");
}

TEST(Config, ATableTestsNothing) {
  EXPECT_EQ(
      error_of(
          R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratio","medium":"linear"}}],
          "tables":[{"title":"T","rows":[{"label":"R","given":{"p":1},"cells":{"c":{"experiment":"e"}},"tolerance":0.1}]}]})"),
      "t.json: /tables/0/rows/0/tolerance: is not tested in a table; use a claim with \"required\": true, \"near\" and "
      "\"tolerance\"");
}

TEST(Config, CommentKeysAreIgnoredEverywhere) {
  EXPECT_EQ(names(plan_of(
                R"("x-a":1,"matrix":{"x-b":[],"estimator":{"type":"ratio","x-c":{}},"medium":{"type":"linear","x-d":[1,2]}})")),
            Names{"ratio/linear/global"});
}

TEST(ParameterValues, VariablesAreReplacedWhenBuiltAndNamedWhenUnset) {
  ::unsetenv("NULLMARK_TEST_FOLDER");
  const Plan plan = plan_of(R"("matrix":{"estimator":"ratio","medium":{"type":"vdb","file":"${NULLMARK_TEST_FOLDER}/a.vdb"}})");
  const Component& vdb = plan.media[0]->field;
  EXPECT_EQ(std::get<std::string>(vdb.values.at("file")), "${NULLMARK_TEST_FOLDER}/a.vdb");
  try {
    make_medium(vdb);
    FAIL() << "expected MissingData";
  } catch (const MissingData& error) {
    EXPECT_NE(std::string(error.what()).find("NULLMARK_TEST_FOLDER"), std::string::npos);
  }
  ::setenv("NULLMARK_TEST_FOLDER", "/nowhere", 1);
  try {
    make_medium(vdb)->build();
    FAIL() << "expected MissingData";
  } catch (const MissingData& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/a.vdb"), std::string::npos) << error.what();
  }
  ::unsetenv("NULLMARK_TEST_FOLDER");
}

TEST(ParameterValues, AssignedValuesReachTheComponent) {
  Component linear{"linear", {{"begin", 2.0}, {"end", 6.0}}, "", ""};
  const auto medium = make_medium(linear)->build();
  const Vec3 middle(0.5, 0.5, 0.5);
  Real extinction = 0;
  medium->extinction({&middle.x(), &middle.y(), &middle.z(), 1}, &extinction);
  EXPECT_EQ(extinction, 4);
  linear.values["ned"] = 1.0;
  EXPECT_THROW(make_medium(linear), ParameterError);
  EXPECT_THROW(make_medium({"linear", {{"end", 6}}, "", ""}), ParameterError);
}

TEST(ParameterValues, DefaultsLieWithinTheirRanges) {
  for (const ComponentKind kind :
       {ComponentKind::estimator, ComponentKind::medium, ComponentKind::majorant, ComponentKind::ray_set})
    for (const ComponentInfo& entry : registered(kind))
      for (const ParameterInfo& parameter : parameters_of(kind, entry.name)) {
        SCOPED_TRACE(entry.name + "/" + parameter.name);
        if (const Real* value = std::get_if<Real>(&parameter.default_value)) {
          EXPECT_TRUE(parameter.range.contains(*value));
        }
        if (const int* value = std::get_if<int>(&parameter.default_value)) {
          EXPECT_GE(*value, parameter.low);
          EXPECT_LE(*value, parameter.high);
        }
        const std::string* text = std::get_if<std::string>(&parameter.default_value);
        if (text && !parameter.allowed.empty()) {
          EXPECT_EQ(std::count(parameter.allowed.begin(), parameter.allowed.end(), *text), 1);
        }
      }
}

}  // namespace
}  // namespace nullmark
