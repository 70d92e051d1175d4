#include "harness/foreign/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "harness/foreign/ascii_line.h"
#include "harness/io/json_input.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

constexpr std::array<const char*, 3> kStreams = {"harness", "key", "free"};
constexpr std::array kGuarantees = {Guarantee::exact, Guarantee::unbiased, Guarantee::consistent, Guarantee::biased};
constexpr std::array kRanges = {SampleRange::binary, SampleRange::unit, SampleRange::non_negative, SampleRange::any_sign};
constexpr std::array kAnswered = {Quantity::transmittance, Quantity::optical_depth, Quantity::free_path};

/// The value of a word.
template <class Values, class Name>
auto named(const JsonNode& node, const Values& values, const char* what, Name&& name) {
  std::vector<std::string> names;
  for (const auto& value : values) names.emplace_back(name(value));
  const std::string word = node.one_of(names, what);
  return values[static_cast<std::size_t>(std::find(names.begin(), names.end(), word) - names.begin())];
}

SampleRange read_range(const JsonNode& node) {
  return named(node, kRanges, "range", [](SampleRange range) { return to_string(range); });
}

bool flag(const JsonNode& node, const char* key) { return node.has(key) && node[key].boolean(); }
std::string text(const JsonNode& node, const char* key) { return node.has(key) ? ascii_line(node[key].string()) : ""; }

Welcome read_welcome_json(const JsonNode& node) {
  node.expect_object();
  Welcome welcome;
  welcome.name = ascii_line(node["name"].string());
  welcome.summary = text(node, "summary");
  welcome.source = text(node, "source");
  welcome.version = text(node, "version");
  for (const JsonNode& one : node["quantities"].elements())
    welcome.quantities |= static_cast<std::uint32_t>(
        bit_of(named(one, kAnswered, "quantity", [](Quantity quantity) { return to_string(quantity); })));
  if (welcome.quantities == 0) node["quantities"].expected("at least one quantity");
  welcome.theory = flag(node, "theory");
  welcome.shared = flag(node, "shared");
  TrackerDescription& told = welcome.grey;
  told.guarantee = named(node["guarantee"], kGuarantees, "guarantee", [](Guarantee one) { return to_string(one); });
  told.range = read_range(node["range"]);
  told.needs_bound = flag(node, "needs_bound");
  told.own_medium = flag(node, "own_medium");
  if (node.has("streams")) {
    const char* const word = named(node["streams"], kStreams, "streams", [](const char* one) { return one; });
    told.streams = static_cast<int>(std::find(kStreams.begin(), kStreams.end(), word) - kStreams.begin());
  }
  if (node.has("order")) told.order = node["order"].positive();
  welcome.chromatic = told;
  if (node.has("range_of_spectra")) welcome.chromatic.range = read_range(node["range_of_spectra"]);
  return welcome;
}

}  // namespace

std::size_t result_bytes(std::size_t count, std::size_t channels, bool free_path, bool own_medium) {
  const std::size_t values = count * channels * sizeof(double), lookups = own_medium ? count * sizeof(std::uint64_t) : 0;
  return values + lookups + (free_path ? count * (sizeof(double) + 1) : 0);
}

void read_result(std::span<const std::byte> payload, std::size_t count, std::size_t channels, nullmark_result& result) {
  PayloadReader reader(payload);
  if (result.value) reader.many(result.value, count * channels);
  if (result.distance) reader.many(result.distance, count);
  if (result.weight) reader.many(result.weight, count * channels);
  if (result.lookups) reader.many(result.lookups, count);
  if (result.event) reader.many(result.event, count);
  reader.expect_end();
}

void refuse_frame(const std::string& message) { throw TrackerFailure("the tracker's process breaks the protocol: " + message); }

void PayloadReader::expect(std::size_t bytes) const {
  if (bytes > rest_.size()) refuse_frame(fmt::format("a frame has {} bytes where {} are expected", rest_.size(), bytes));
}

void PayloadReader::expect_end() const {
  if (!rest_.empty()) refuse_frame(fmt::format("a frame has {} bytes too many", rest_.size()));
}

void write_ray(const nullmark_ray& ray, PayloadWriter& out) {
  RayHead head;
  head.channels = ray.channels;
  head.segments = ray.segments;
  head.crossing = ray.crossing;
  head.id = ray.id;
  std::copy_n(ray.origin, 3, head.origin);
  std::copy_n(ray.direction, 3, head.direction);
  head.begin = ray.begin;
  head.end = ray.end;
  out.one(head);
  const auto segments = static_cast<std::size_t>(ray.segments), channels = static_cast<std::size_t>(ray.channels);
  out.many(ray.segment_end, segments);
  out.many(ray.rate, segments);
  for (const double* extinction : {ray.minimum, ray.average, ray.maximum}) out.many(extinction, segments * channels);
  out.many(ray.albedo, channels);
}

ReceivedRay read_ray(std::span<const std::byte> payload) {
  PayloadReader reader(payload);
  const auto head = reader.one<RayHead>();
  if (head.channels < 1 || head.channels > kMaxChannels || head.segments < 0)
    refuse_frame(fmt::format("a ray of {} channels and {} segments", head.channels, head.segments));
  const auto segments = static_cast<std::size_t>(head.segments), channels = static_cast<std::size_t>(head.channels);
  ReceivedRay received;
  received.numbers = reader.many<double>(segments * (2 + 3 * channels) + channels);
  reader.expect_end();
  nullmark_ray& ray = received.ray;
  ray.size = sizeof ray;
  ray.channels = head.channels;
  ray.segments = head.segments;
  ray.crossing = head.crossing;
  ray.id = head.id;
  std::copy_n(head.origin, 3, ray.origin);
  std::copy_n(head.direction, 3, ray.direction);
  ray.begin = head.begin;
  ray.end = head.end;
  const double* at = received.numbers.data();
  ray.segment_end = at;
  ray.rate = at += segments;
  ray.minimum = at += segments;
  ray.average = at += segments * channels;
  ray.maximum = at += segments * channels;
  ray.albedo = at + segments * channels;
  return received;
}

Welcome read_welcome(std::span<const std::byte> payload) {
  PayloadReader reader(payload);
  const auto greeting = reader.one<Greeting>();
  const Greeting expected;
  if (!std::equal(std::begin(greeting.magic), std::end(greeting.magic), expected.magic))
    refuse_frame("its first frame is no nullmark greeting");
  if (greeting.endian != expected.endian) refuse_frame("its numbers are not little-endian");
  if (greeting.version != expected.version)
    refuse_frame(fmt::format("found version {}; expected {}", greeting.version, expected.version));
  try {
    return read_welcome_json(JsonNode(parse_json(reader.text(), "welcome"), "welcome"));
  } catch (const InputError& error) {
    refuse_frame(ascii_line(error.what()));
  }
}

void write_welcome(const Welcome& welcome, PayloadWriter& out) {
  Json quantities = Json::array();
  for (const Quantity quantity : kAnswered)
    if (welcome.quantities & static_cast<std::uint32_t>(bit_of(quantity))) quantities.push_back(to_string(quantity));
  const TrackerDescription& told = welcome.grey;
  Json json = {{"name", welcome.name},
               {"summary", welcome.summary},
               {"source", welcome.source},
               {"version", welcome.version},
               {"quantities", std::move(quantities)},
               {"guarantee", to_string(told.guarantee)},
               {"range", to_string(told.range)},
               {"range_of_spectra", to_string(welcome.chromatic.range)},
               {"needs_bound", told.needs_bound},
               {"own_medium", told.own_medium},
               {"streams", kStreams[static_cast<std::size_t>(told.streams)]},
               {"theory", welcome.theory},
               {"shared", welcome.shared}};
  if (told.order > 0) json["order"] = told.order;
  out.one(Greeting{});
  out.text(json.dump());
}

}  // namespace nullmark
