#include "harness/sampling/test_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

namespace nullmark {

void Evidence::bet(const MeanTest& test, int errors_per_sum, std::span<const Real> sums) {
  std::size_t rates = 0;
  for (const auto& [role, bet] : test.bets) rates += bet.rates.size();
  logs.resize(rates, 0);
  std::size_t at = 0;
  for (const auto& [role, bet] : test.bets) {
    if (bet.errors_per_sum == errors_per_sum) bet_on(bet, sums, std::span(logs).subspan(at, bet.rates.size()));
    at += bet.rates.size();
  }
}

Evidence& Evidence::operator+=(const Evidence& other) {
  logs.resize(std::max(logs.size(), other.logs.size()), 0);
  for (std::size_t i = 0; i < other.logs.size(); ++i) logs[i] += other.logs[i];
  errors += other.errors;
  total_error += other.total_error;
  largest_error = std::max(largest_error, other.largest_error);
  return *this;
}

TestRecord test_record(const MeanTest& test, const Evidence& evidence) {
  TestRecord record;
  record.channel = test.channel;
  record.group = test.group;
  record.samples = evidence.errors;
  record.epsilon = test.epsilon;
  record.reference_error = test.reference_error;
  record.reference = test.reference;
  if (evidence.errors > 0) record.mean_error = evidence.total_error / static_cast<Real>(evidence.errors);
  record.variance = test.variance;
  record.basis = test.basis;
  record.largest_error = evidence.largest_error;
  record.rounding = test.rounding;
  record.planned = test.planned;
  if (test.deterministic && record.right()) return record;
  if (test.deterministic && !(record.largest_error <= test.certainly_biased)) {
    record.log_e_fail = kCertain;
    return record;
  }

  // By role and kind: kinds weigh the same, however many rates each has.
  std::map<std::pair<Role, Bet::Kind>, std::vector<Real>> wealth;
  std::size_t at = 0;
  for (const auto& [role, bet] : test.bets) {
    const std::uint64_t sums = evidence.errors / static_cast<std::uint64_t>(bet.errors_per_sum);
    for (const Real rate : bet.rates) {
      const Real log = at < evidence.logs.size() ? evidence.logs[at] : 0;
      wealth[{role, bet.kind}].push_back(log - log_denominator(bet, rate, sums));
      ++at;
    }
  }
  const auto log_e = [&](Role role) {
    std::vector<Real> kinds;
    for (const auto& [key, logs] : wealth)
      if (key.first == role) kinds.push_back(log_mean_exp(logs));
    // Rounded, so that the file tells as much as the decision used.
    constexpr Real kDigits = 1e4;
    return std::round(log_mean_exp(kinds) * kDigits) / kDigits;
  };
  record.log_e_fail = log_e(Role::fail);
  if (test.deterministic) return record;
  record.log_e_low = log_e(Role::low);
  record.log_e_high = log_e(Role::high);
  record.log_e_beyond = log_e(Role::beyond);
  if (test.group != MeanTest::kAllRays) return record;
  for (const auto& [role, bet] : test.bets)
    if (role == Role::fail && bet.side > 0) record.rates.insert(record.rates.end(), bet.rates.begin(), bet.rates.end());
  return record;
}

namespace {

/// Sums of so many numbers each, less what is expected of one.  Which numbers share a sum is free; a stride lets a register of
/// sums advance together.
template <class Number>
std::span<const Real> sums_of(std::span<const Number> numbers, int together, Real expected, std::vector<Real>& sums) {
  if constexpr (std::is_same_v<Number, const Real> || std::is_same_v<Number, Real>)
    if (together == 1 && expected == 0) return numbers;
  const std::size_t count = numbers.size() / static_cast<std::size_t>(together);
  sums.resize(count);
  constexpr std::size_t kSideBySide = 64;
  std::array<Real, kSideBySide> run;
  for (std::size_t j = 0; j < count; j += kSideBySide) {
    const std::size_t width = std::min(kSideBySide, count - j);
    const auto add = [&](std::size_t n) {
      const Number* from = &numbers[j];
      for (std::size_t i = 0; i < n; ++i) run[i] = static_cast<Real>(from[i]);
      for (int k = 1; k < together; ++k) {
        from += count;
        for (std::size_t i = 0; i < n; ++i) run[i] += static_cast<Real>(from[i]);
      }
      for (std::size_t i = 0; i < n; ++i) sums[j + i] = run[i] - expected;
    };
    // A width that the compiler knows stays in registers.
    width == kSideBySide ? add(kSideBySide) : add(width);
  }
  return sums;
}

/// Numbers that are bet on at once: as many as have gathered, or as many as arrive together.
constexpr std::size_t kTogether = 8192, kEnough = 2048;

}  // namespace

EvidenceAccumulator::Memory& EvidenceAccumulator::Memory::of_this_thread() {
  static thread_local Memory memory;
  return memory;
}

EvidenceAccumulator::Memory& EvidenceAccumulator::Memory::of_variances() {
  static thread_local Memory memory;
  return memory;
}

EvidenceAccumulator::EvidenceAccumulator(const TestPlan* plan, std::span<const MeanTest> tests, std::size_t channels,
                                         Memory& memory, std::map<std::size_t, Evidence>& out)
    : plan_(plan), tests_(tests), out_(out), pooled_(channels), grouped_(channels), pending_(memory.pending), sums_(memory.sums) {
  pending_.resize(std::max(pending_.size(), tests_.size()));
  for (std::vector<std::vector<Real>>& lengths : pending_)
    for (std::vector<Real>& waiting : lengths) waiting.clear();  // of a run that was stopped
  for (std::size_t i = 0; i < tests_.size(); ++i) {
    const MeanTest& test = tests_[i];
    const std::size_t lengths = test.sum_lengths.size();
    pending_[i].resize(std::max(pending_[i].size(), lengths));
    sums_.resize(std::max(sums_.size(), lengths));
    if (test.channel == MeanTest::kLookups) {
      lookups_ = i;
    } else if (test.group == MeanTest::kAllRays) {
      pooled_[static_cast<std::size_t>(test.channel)] = i;
    } else {
      auto& list = grouped_[static_cast<std::size_t>(test.channel)];
      list.resize(std::max(list.size(), static_cast<std::size_t>(test.group) + 1));
      list[static_cast<std::size_t>(test.group)] = i;
    }
  }
}

/// Every sum is one of those before it: the shortest of the numbers, less what is expected of each.
template <class Number, class Largest>
void EvidenceAccumulator::add_to(std::size_t test, std::span<const Number> numbers, Real expected, Largest largest_error) {
  const std::vector<int>& lengths = tests_[test].sum_lengths;
  std::span<const Real> sums = sums_of(numbers, lengths[0], expected * lengths[0], sums_[0]);
  feed(test, 0, sums);
  for (std::size_t i = 1; i < lengths.size(); ++i) {
    sums = sums_of(sums, lengths[i] / lengths[i - 1], 0, sums_[i]);
    feed(test, i, sums);
  }
  Evidence& evidence = out_[test];
  evidence.errors += numbers.size();
  for (const Real x : sums) evidence.total_error += x;
  if (tests_[test].deterministic) evidence.largest_error = std::max(evidence.largest_error, largest_error());
}

void EvidenceAccumulator::add_errors(std::size_t ray, std::size_t channel, std::span<const Real> errors) {
  if (!pooled_[channel]) return;
  const auto largest = [&] {
    Real most = 0;
    for (const Real error : errors) most = std::max(most, std::abs(error));
    return most;
  };
  add_to(*pooled_[channel], errors, 0, largest);
  if (!grouped_[channel].empty()) add_to(*grouped_[channel][static_cast<std::size_t>(plan_->group_of[ray])], errors, 0, largest);
}

void EvidenceAccumulator::add_lookups(std::size_t ray, std::span<const std::uint32_t> lookups) {
  if (!lookups_ || lookups.empty()) return;
  const Real expected = plan_->lookups[ray];
  add_to(*lookups_, lookups, expected, [&] {
    const auto [least, most] = std::minmax_element(lookups.begin(), lookups.end());
    return std::max(expected - *least, *most - expected);
  });
}

void EvidenceAccumulator::finish() {
  for (std::size_t test = 0; test < tests_.size(); ++test)
    for (std::size_t length = 0; length < tests_[test].sum_lengths.size(); ++length) flush(test, length);
}

void EvidenceAccumulator::feed(std::size_t test, std::size_t length, std::span<const Real> sums) {
  if (tests_[test].bets.empty()) return;
  std::vector<Real>& waiting = pending_[test][length];
  if (waiting.empty() && sums.size() >= kEnough) {
    out_[test].bet(tests_[test], tests_[test].sum_lengths[length], sums);
    return;
  }
  waiting.insert(waiting.end(), sums.begin(), sums.end());
  if (waiting.size() >= kTogether) flush(test, length);
}

void EvidenceAccumulator::flush(std::size_t test, std::size_t length) {
  std::vector<Real>& waiting = pending_[test][length];
  if (waiting.empty()) return;
  out_[test].bet(tests_[test], tests_[test].sum_lengths[length], waiting);
  waiting.clear();
}

}  // namespace nullmark
