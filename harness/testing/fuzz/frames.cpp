#include "harness/foreign/frames.h"

#include <cmath>

#include "harness/foreign/request_answers.h"
#include "harness/foreign/sample_host.h"
#include "harness/testing/fuzz/target.h"
#include "media/base/registry.h"

namespace nullmark {
namespace {

class AnyWorkspace final : public Workspace {};

/// A ray of two segments through a linear medium, and what answers its samples.
struct Scene {
  std::shared_ptr<const Medium> medium = Registry<MediumEntry>::instance().find("linear")->make()->build();
  PreparedRay context;
  SampleHost host;
  AnyWorkspace workspace;

  Scene() {
    context.world = context.local = Ray{{0, 0.5, 0.5}, {1, 0, 0}, 0, 1};
    const Extrema bounds = Extrema::grey(0, 1, 2);
    context.bounds.start({{0, 0.5, 2, bounds, 1}, {0.5, 1, 2, bounds, 1}}, Crossing::rewind);
    workspace.most_lookups = 1000;
    host.begin_ray(*medium, context);
  }
};

/// Requests of a tracker that is asked for 8 samples: a byte of kind, two bytes of length, the payload, and so on.
void answer_all(std::span<const std::byte> rest) {
  constexpr std::size_t kSamples = 8;
  Scene scene;
  std::vector<std::uint32_t> lookups(kSamples);
  Counters counters;
  scene.host.begin_block(scene.workspace, 1, 0, kSamples, lookups, counters);
  RequestAnswers requests(scene.host.calls(), 1);
  PayloadWriter out;
  double value[kSamples], distance[kSamples];
  std::uint8_t event[kSamples];
  std::uint64_t told[kSamples];
  while (rest.size() >= 3) {
    const auto kind = static_cast<FrameKind>(rest[0]);
    const std::size_t size =
        std::min(rest.size() - 3, std::to_integer<std::size_t>(rest[1]) + 256 * std::to_integer<std::size_t>(rest[2]));
    const auto payload = rest.subspan(3, size);
    rest = rest.subspan(3 + size);
    if (kind == FrameKind::result) {
      nullmark_result result = {};
      result.value = value;
      result.lookups = told;
      if (size % 2) result.distance = distance, result.event = event;
      read_result(payload, kSamples, 1, result);
      return;
    }
    if (requests.answer(kind, payload, out) != NULLMARK_OK) return;
    for (std::uint32_t count : lookups)
      if (count > scene.workspace.most_lookups) __builtin_trap();
  }
}

}  // namespace

void fuzz_frames(const std::string& input) {
  if (input.empty()) return;
  const auto rest = std::as_bytes(std::span(input)).subspan(1);
  try {
    switch (input[0] % 3) {
      case 0: {
        // What a process says of itself survives being told again.
        const Welcome welcome = read_welcome(rest);
        PayloadWriter again;
        write_welcome(welcome, again);
        if (read_welcome(again.bytes()).quantities != welcome.quantities) __builtin_trap();
        break;
      }
      case 1: {
        const ReceivedRay received = read_ray(rest);
        PayloadWriter again;
        write_ray(received.ray, again);
        if (again.bytes().size() != rest.size()) __builtin_trap();
        break;
      }
      default:
        answer_all(rest);
    }
  } catch (const TrackerFailure&) {
    // Refused as users are told.
  }
}

}  // namespace nullmark
