#include "harness/run/provenance.h"

#include <features.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <hwy/highway.h>
#include <openvdb/version.h>
#include <tbb/version.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <boost/version.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "harness/model/hash.h"
#include "harness/model/program_name.h"
#include "harness/registry/plugin.h"
#include "harness/run/source_state.h"

#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

extern "C" {
/// The program of the tree defines it, and no other that is linked with these libraries.
[[gnu::weak]] extern const char nullmark_itself;
}

namespace nullmark {
namespace {

using Json = nlohmann::ordered_json;

std::string compiler() {
#if defined(__clang__)
  return fmt::format("clang {}", __clang_version__);
#else
  return fmt::format("gcc {}", __VERSION__);
#endif
}

std::string libc() {
#ifdef __GLIBC__
  return fmt::format("glibc {}", gnu_get_libc_version());
#else
  return "unknown";
#endif
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0)
      if (const std::size_t at = line.find(": "); at != std::string::npos) return line.substr(at + 2);
  return "unknown";
}

/// Bits of the widest vector registers this file was compiled for.
constexpr int simd_bits() {
#if defined(__AVX512F__)
  return 512;
#elif defined(__AVX__)
  return 256;
#elif defined(__SSE2__) || defined(__ARM_NEON)
  return 128;
#else
  return 64;
#endif
}

/// Lanes that vectorised code was compiled for; what -march promises can still leave a target out.
const char* simd_target() { return hwy::TargetName(HWY_STATIC_TARGET); }

Json libraries() {
  return {{"openvdb", OPENVDB_LIBRARY_VERSION_STRING},
          {"tbb", TBB_VERSION_STRING},
          {"eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"boost", fmt::format("{}.{}.{}", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000, BOOST_VERSION % 100)},
          {"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)},
          {"nlohmann_json",
           fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH)},
          {"cli11", CLI11_VERSION}};
}

/// Of this executable, 16 hexadecimal digits.
std::string executable_hash() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  std::vector<char> part(std::size_t{1} << 20);
  std::uint64_t hash = fnv1a("");
  while (file.read(part.data(), static_cast<std::streamsize>(part.size())) || file.gcount() > 0)
    hash = fnv1a({part.data(), static_cast<std::size_t>(file.gcount())}, hash);
  return fmt::format("{:016x}", hash);
}

/// Null for nullmark itself; of another program what it says of itself, and what it is.
Json plugin() {
  static const Json plugin = []() -> Json {
    if (&nullmark_itself != nullptr) return nullptr;
    const std::vector<PluginEntry>& stated = Registry<PluginEntry>::instance().entries();
    const bool known = !stated.empty();
    return {{"name", known ? stated[0].name : program_name()},
            {"version", known ? stated[0].version : "unknown"},
            {"hash", executable_hash()}};
  }();
  return plugin;
}

}  // namespace

std::string iso_time(std::chrono::system_clock::time_point time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", std::chrono::time_point_cast<std::chrono::seconds>(time));
}

std::map<std::string, std::string> make_provenance(const RunContext& context, std::chrono::system_clock::time_point end) {
  const auto text = [](const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); };
  const SourceState source = source_state();
  const double seconds = std::chrono::duration<double>(end - context.start).count();
  std::map<std::string, std::string> provenance = {
      {"version", text(NULLMARK_VERSION)},
      {"git", text({{"commit", source.commit}, {"dirty", source.dirty}, {"changes", source.changes}})},
      {"compiler", text({{"name", compiler()}, {"flags", source.compiler_flags}, {"build_type", NULLMARK_BUILD_TYPE}})},
      {"libc", text(libc())},
      {"cpu", text({{"model", cpu_model()}, {"cores", std::thread::hardware_concurrency()}})},
      {"threads", text(context.threads)},
      {"verdict_share", context.verdict_share ? text(*context.verdict_share) : "null"},
      {"statistics_share", context.statistics_share ? text(*context.statistics_share) : "null"},
      {"simd_bits", text(simd_bits())},
      {"target", text({{"march", NULLMARK_ARCH}, {"simd", simd_target()}})},
      {"libraries", text(libraries())},
      {"command_line", text(Json(context.command_line))},
      {"seeds", text(Json(context.seeds))},
      {"selected", text(context.selected)},
      {"start", text(iso_time(context.start))},
      {"seconds", text(seconds)}};
  Json phases = Json::object();
  for (const Phase& phase : context.phases) phases[phase.name] = {{"seconds", phase.wall}, {"cpu_seconds", phase.cpu}};
  provenance["phases"] = text(phases);
  if (const Json other = plugin(); !other.is_null()) provenance["plugin"] = text(other);
  if (!context.filter.empty()) provenance["filter"] = text(context.filter);
  if (context.covering) provenance["covering"] = text(true);
  if (!context.shard.empty()) provenance["shard"] = text(context.shard);
  return provenance;
}

RunRecord make_run_record(const Plan& plan, std::vector<CellRecord> cells, const RunContext& context) {
  RunRecord run;
  run.name = plan.name;
  run.config_text = plan.config_text;
  run.provenance = make_provenance(context, std::chrono::system_clock::now());
  run.cells = std::move(cells);
  run.tables = plan.tables;
  run.claims = plan.claims;
  return run;
}

std::string version_line() {
  const SourceState source = source_state();
  return fmt::format("nullmark {} (commit {}{}; {})", NULLMARK_VERSION, source.commit, source.dirty ? ", dirty" : "",
                     NULLMARK_BUILD_TYPE);
}

}  // namespace nullmark
