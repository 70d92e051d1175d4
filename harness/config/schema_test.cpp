#include "harness/config/schema.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

/// The schemas as someone else's validator understands them.
class Checker {
 public:
  explicit Checker(const Json& schema) {
    const nlohmann::json plain = schema;
    valijson::adapters::NlohmannJsonAdapter adapter(plain);
    valijson::SchemaParser().populateSchema(adapter, schema_);
  }

  /// The first objection; empty where there is none.
  std::string operator()(const std::string& text) const {
    const nlohmann::json json = nlohmann::json::parse(text);
    valijson::adapters::NlohmannJsonAdapter adapter(json);
    valijson::ValidationResults results;
    valijson::Validator validator;
    if (validator.validate(schema_, adapter, &results)) return "";
    valijson::ValidationResults::Error error;
    results.popError(error);
    std::string place;
    for (const std::string& word : error.context) place += word;
    return place + ": " + error.description;
  }

 private:
  valijson::Schema schema_;
};

TEST(Schema, AcceptsTheConfigurationsOfTheTree) {
  const Checker check(config_schema());
  for (const auto& entry : std::filesystem::recursive_directory_iterator(NULLMARK_SOURCE_DIR "/configs"))
    if (entry.path().extension() == ".json") {
      EXPECT_EQ(check(read_file(entry.path().string())), "") << entry.path();
    }
  EXPECT_EQ(check(example_plan().config_text), "");
}

TEST(Schema, RefusesWhatTheReaderRefuses) {
  const Checker check(config_schema());
  const auto experiment = [](const std::string& keys) {
    return R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,)" + keys + "}]}";
  };
  const std::string good = R"("matrix":{"estimator":"ratio","medium":"linear"})";
  EXPECT_EQ(check(experiment(good)), "");
  for (const std::string& keys :
       {good + R"(,"qantity":"transmittance")", good + R"(,"measurement":{"quantise_bits":-1})", good + R"(,"seed":-1)",
        std::string(R"("matrix":{"estimator":"ratoi","medium":"linear"})"),
        std::string(R"("matrix":{"estimator":"ratio","medium":{"type":"linear","end":-1}})"),
        std::string(R"("matrix":{"estimator":"ratio","medium":{"type":"linear","ned":1}})"),
        std::string(R"("matrix":{"estimator":{"type":"residual_ratio","control":"averge"},"medium":"linear"})")}) {
    EXPECT_NE(check(experiment(keys)), "") << keys;
    EXPECT_THROW(read_config(experiment(keys), "t.json"), InputError) << keys;
  }
  EXPECT_NE(check(R"({"experiments":[]})"), "");
  const auto table = [&](const std::string& keys) {
    std::string text = experiment(good);
    text.back() = ',';
    return text + R"("tables":[{"title":"T","rows":[{"label":"R","given":{"p":1})" + keys + "}]}]}";
  };
  EXPECT_EQ(check(table("")), "");
  EXPECT_NE(check(table(R"(,"tolerance":0.1)")), "");
}

TEST(Schema, AcceptsResultsAndRefusesBrokenOnes) {
  const Checker check(results_schema());
  RunRecord run = example_results();
  run.cells[0] = unsampled(run.cells[0], Status::skipped, "no data");
  EXPECT_EQ(check(results_text(run)), "");
  std::string broken = results_text(run);
  broken.replace(broken.find("\"skipped\""), 9, "\"skippid\"");
  EXPECT_NE(check(broken), "");
}

}  // namespace
}  // namespace nullmark
