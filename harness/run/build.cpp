#include "harness/run/build.h"

#include <fmt/format.h>

#include "harness/run/provenance.h"

namespace nullmark {
namespace {

std::string source_text(const Build& build) {
  constexpr std::size_t kDigits = 10;
  std::string text = build.commit.empty() || build.commit == "unknown" ? fmt::format("version {}", build.version)
                                                                       : "commit " + build.commit.substr(0, kDigits);
  if (!build.changes.empty()) text += " with changes " + build.changes;
  return text;
}

std::string plugin_text(const Build& build, bool with_hash) {
  if (build.plugin.empty()) return "nullmark itself";
  return "the plug-in " + build.plugin + (with_hash ? ", hash " + build.plugin_hash : "");
}

}  // namespace

Build build_of(const std::map<std::string, std::string>& provenance) {
  const auto json = [&](const char* key) {
    const auto at = provenance.find(key);
    return at == provenance.end() ? Json() : known_json(at->second);
  };
  const auto word = [](const Json& object, const char* key) {
    return object.is_object() && object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : std::string();
  };
  const Json git = json("git"), compiler = json("compiler"), target = json("target"), plugin = json("plugin");
  Build build;
  if (const Json version = json("version"); version.is_string()) build.version = version.get<std::string>();
  build.commit = word(git, "commit");
  build.changes = word(git, "changes");
  const bool dirty = git.is_object() && git.contains("dirty") && git["dirty"] == true;
  if (dirty && !git.contains("changes")) build.changes = "unknown";
  if (plugin.is_object()) build.plugin = word(plugin, "name") + " " + word(plugin, "version");
  build.plugin_hash = word(plugin, "hash");
  const Json libc = json("libc");
  build.environment =
      fmt::format("{} {} ({}), {}, {} {}", word(compiler, "name"), word(compiler, "flags"), word(compiler, "build_type"),
                  libc.is_string() ? libc.get<std::string>() : "", word(target, "march"), word(target, "simd"));
  return build;
}

const Build& this_build() {
  static const Build build = build_of(make_provenance({}, std::chrono::system_clock::now()));
  return build;
}

Json build_json(const Build& build) {
  return {{"version", build.version}, {"commit", build.commit},           {"changes", build.changes},
          {"plugin", build.plugin},   {"plugin_hash", build.plugin_hash}, {"environment", build.environment}};
}

Build read_build(const JsonNode& node) {
  node.expect_object();
  return {node["version"].string(), node["commit"].string(),      node["changes"].string(),
          node["plugin"].string(),  node["plugin_hash"].string(), node["environment"].string()};
}

Builds builds_of(const std::string& text) {
  if (text.empty() || text == "same") return Builds::same;
  if (text == "any") return Builds::any;
  throw InputError(fmt::format("--builds: found \"{}\"; expected \"same\" or \"any\"", text));
}

void expect_joinable(const std::string& file, const Build& found, const std::string& of, const Build& expected, Builds builds) {
  const auto refuse = [&](const std::string& one, const std::string& other, const char* remedy) {
    throw InputError(fmt::format("{}: found cells of {}; expected those of {}, {}; {}", file, one, of, other, remedy));
  };
  const char* const again = "run all cells by one build";
  if (found.commit != expected.commit || found.changes != expected.changes || found.version != expected.version)
    refuse(source_text(found), source_text(expected), again);
  const bool alike = found.environment == expected.environment;
  // Another compiler makes another executable of the same plug-in.
  if (found.plugin != expected.plugin || (alike && found.plugin_hash != expected.plugin_hash))
    refuse(plugin_text(found, alike), plugin_text(expected, alike), again);
  if (!alike && builds == Builds::same)
    refuse(found.environment, expected.environment, "--builds any joins them, marks the cells and ranks them apart");
}

void mark_build(CellRecord& record, const Build& of_cell, const Build& of_results) {
  if (record.build.empty()) record.build = of_cell.environment;
  if (record.build == of_results.environment) record.build.clear();
}

}  // namespace nullmark
