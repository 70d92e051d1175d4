#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "harness/foreign/frames.h"

namespace nullmark {

/// Answers the requests that a process makes during one `sample`, by the harness's calls.
class RequestAnswers {
 public:
  RequestAnswers(const nullmark_harness& harness, std::size_t channels) : harness_(harness), channels_(channels) {}

  /// NULLMARK_OK with the payload of the answer in `out`, or what the harness said instead.  Throws TrackerFailure for a payload
  /// that is no request of this kind.
  std::int32_t answer(FrameKind kind, std::span<const std::byte> payload, PayloadWriter& out);

 private:
  std::int32_t step(PayloadWriter& out);

  const nullmark_harness& harness_;
  std::size_t channels_;
  std::vector<double> at_, looked_up_;
  std::vector<std::uint32_t> sample_, alive_;
  std::vector<std::size_t> inside_;
};

}  // namespace nullmark
