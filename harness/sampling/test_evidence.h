#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "harness/model/record.h"
#include "harness/sampling/test_plan.h"

namespace nullmark {

/// Evidence of one test so far.
struct Evidence {
  std::vector<Real> logs;    ///< bet after bet, rate after rate
  std::uint64_t errors = 0;  ///< number of errors
  Real total_error = 0;
  Real largest_error = 0;

  /// Applies the bets that take sums of this many errors to these sums.
  void bet(const MeanTest& test, int errors_per_sum, std::span<const Real> sums);
  Evidence& operator+=(const Evidence& other);
};

/// The figures of a test, ready for the record.
TestRecord test_record(const MeanTest& test, const Evidence& evidence);

/// Collects errors for the tests of a plan: sums them in runs of 2, 4, ... as the bets require, gathers the sums over rays, and
/// bets on thousands of them at once.
class EvidenceAccumulator {
 public:
  /// Reused from chunk to chunk, because fresh pages cost more than writing to them.
  struct Memory {
    std::vector<std::vector<std::vector<Real>>> pending;  ///< by test and length of its sums
    std::vector<std::vector<Real>> sums;                  ///< by length

    static Memory& of_this_thread();
    static Memory& of_variances();
  };

  /// Adds the evidence of `tests` to `out`, by test.  `tests` are the mean or the variance tests of `plan`.
  EvidenceAccumulator(const TestPlan* plan, std::span<const MeanTest> tests, std::size_t channels, Memory& memory,
                      std::map<std::size_t, Evidence>& out);

  void add_errors(std::size_t ray, std::size_t channel, std::span<const Real> errors);
  void add_lookups(std::size_t ray, std::span<const std::uint32_t> lookups);

  /// Bets on the remaining errors.
  void finish();

 private:
  template <class Number, class Largest>
  void add_to(std::size_t test, std::span<const Number> numbers, Real expected, Largest largest_error);
  void feed(std::size_t test, std::size_t length, std::span<const Real> sums);
  void flush(std::size_t test, std::size_t length);

  const TestPlan* plan_;
  std::span<const MeanTest> tests_;
  std::map<std::size_t, Evidence>& out_;
  std::vector<std::optional<std::size_t>> pooled_;                // test by channel
  std::vector<std::vector<std::optional<std::size_t>>> grouped_;  // by channel and group
  std::optional<std::size_t> lookups_;
  std::vector<std::vector<std::vector<Real>>>& pending_;
  std::vector<std::vector<Real>>& sums_;
};

}  // namespace nullmark
