#include "harness/foreign/request_answers.h"

#include <fmt/format.h>

#include <algorithm>

namespace nullmark {

std::int32_t RequestAnswers::answer(FrameKind kind, std::span<const std::byte> payload, PayloadWriter& out) {
  PayloadReader reader(payload);
  const std::size_t n = reader.one<std::uint32_t>();
  reader.one<std::uint32_t>();
  const std::size_t numbers = kind == FrameKind::lookup ? n : kind == FrameKind::lookup_at ? 3 * n : 0;
  if (reader.left() != numbers * sizeof(double) + n * sizeof(std::uint32_t))
    refuse_frame(fmt::format("a request for {} samples has {} bytes", n, payload.size()));
  at_.resize(numbers);
  reader.many(at_.data(), numbers);
  sample_.resize(n);
  reader.many(sample_.data(), n);
  out.clear();
  const auto count = static_cast<std::int64_t>(n);
  switch (kind) {
    case FrameKind::lookup:
      return harness_.lookup(harness_.self, count, sample_.data(), at_.data(), out.room<double>(n * channels_));
    case FrameKind::lookup_at:
      return harness_.lookup_at(harness_.self, count, sample_.data(), at_.data(), out.room<double>(n * channels_));
    case FrameKind::uniform:
      return harness_.uniform(harness_.self, count, sample_.data(), out.room<double>(n));
    case FrameKind::next: {
      double* const t = out.room<double>(2 * n);
      return harness_.next(harness_.self, count, sample_.data(), t, t + n);
    }
    case FrameKind::step:
      return step(out);
    default:
      refuse_frame(fmt::format("found frame {}; expected a request", static_cast<std::uint32_t>(kind)));
  }
}

std::int32_t RequestAnswers::step(PayloadWriter& out) {
  const std::size_t n = sample_.size();
  double* const t = out.room<double>((2 + channels_) * n);
  double* const extinction = t + 2 * n;
  std::fill_n(extinction, n * channels_, 0.);
  std::int32_t code = harness_.next(harness_.self, static_cast<std::int64_t>(n), sample_.data(), t, t + n);
  if (code != NULLMARK_OK) return code;
  inside_.clear();
  at_.clear();
  alive_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (!(t[i] < kInfinity)) continue;
    inside_.push_back(i);
    at_.push_back(t[i]);
    alive_.push_back(sample_[i]);
  }
  looked_up_.resize(inside_.size() * channels_);
  code = harness_.lookup(harness_.self, static_cast<std::int64_t>(inside_.size()), alive_.data(), at_.data(), looked_up_.data());
  for (std::size_t j = 0; j < inside_.size(); ++j)
    std::copy_n(&looked_up_[j * channels_], channels_, extinction + inside_[j] * channels_);
  return code;
}

}  // namespace nullmark
