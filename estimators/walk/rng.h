#pragma once

#include <bit>
#include <cstdint>

#include "media/base/elementary.h"
#include "media/base/philox.h"
#include "media/base/types.h"

namespace nullmark {

/// Where a sample's random stream comes from: results depend on nothing else, so threads, shards and resumed runs agree, and one
/// sample can be replayed alone.
struct SampleAddress {
  std::uint64_t key = 0;  ///< from seed and medium (and the estimator, where common random numbers are not wanted)
  std::uint32_t ray = 0;
  std::uint64_t sample = 0;
};

/// Where each use of a cell's streams begins, so that no two share one.  Results and verdicts draw samples from 0.
namespace first_sample {
inline constexpr std::uint64_t kLaws = std::uint64_t{1} << 61;
inline constexpr std::uint64_t kReliance = std::uint64_t{5} << 59;
inline constexpr std::uint64_t kFreePaths = std::uint64_t{3} << 60;
inline constexpr std::uint64_t kPilot = std::uint64_t{1} << 62;
inline constexpr std::uint64_t kCountedLookups = std::uint64_t{5} << 60;
}  // namespace first_sample

/// xoroshiro128++ [Blackman and Vigna 2021], its state one Philox4x32-10 block of the address.  Counts its draws.
class Rng {
 public:
  Rng() = default;
  explicit Rng(const SampleAddress& at) : sample_(at.sample) {
    const auto block = philox4x32({static_cast<std::uint32_t>(at.sample), static_cast<std::uint32_t>(at.sample >> 32), at.ray, 0},
                                  {static_cast<std::uint32_t>(at.key), static_cast<std::uint32_t>(at.key >> 32)});
    a_ = block[0] | std::uint64_t{block[1]} << 32;
    b_ = block[2] | std::uint64_t{block[3]} << 32;
    if ((a_ | b_) == 0) b_ = 1;  // the one state xoroshiro cannot leave
  }

  /// Multiple of 2^-53 in [0, 1).
  Real uniform() {
    ++draws_;
    ready_ = -1;
    return static_cast<Real>(next() >> 11) * 0x1p-53;
  }

  /// The same; lanes count such draws for the walks that go on alone.
  Real uniform(bool) { return uniform(); }

  /// The same where it is drawn; 0 and no draw elsewhere.
  Real uniform_where(bool drawn) { return drawn ? uniform() : 0; }

  /// Unit exponential -log(1 - u); 1 - u is exact, so u = 0 gives 0 and u = 1 - 2^-53 gives 36.7.
  Real exponential() {
    if (ready_ < 0) return negative_logarithm(1 - uniform());
    const Real e = ready_;
    ready_ = -1;
    ++draws_;
    next();
    return e;
  }

  /// 1 - u of the next draw, which is left undrawn; and its exponential, computed ahead for many streams at once.  It serves if
  /// the next draw is an exponential and is forgotten if it is not.
  Real peek() const { return 1 - static_cast<Real>(output() >> 11) * 0x1p-53; }
  void make_ready(Real exponential) { ready_ = exponential; }

  std::uint64_t draws() const { return draws_; }

  /// Index of the sample this stream belongs to.
  std::uint64_t sample() const { return sample_; }

 private:
  std::uint64_t output() const { return std::rotl(a_ + b_, 17) + a_; }

  std::uint64_t next() {
    const std::uint64_t a = a_, result = output();
    const std::uint64_t b = b_ ^ a;
    a_ = std::rotl(a, 49) ^ b ^ (b << 21);
    b_ = std::rotl(b, 28);
    return result;
  }

  std::uint64_t a_ = 0, b_ = 1, draws_ = 0, sample_ = 0;
  Real ready_ = -1;
};

/// Unit exponentials e = -log(1 - u) and e^-e = 1 - u.
template <class Number>
struct ExponentialAndDecay {
  Number exponential, decay;
};

/// The next exponential of a stream; one that does not show its numbers takes e^-e from e.
[[gnu::always_inline]] inline ExponentialAndDecay<Real> exponential_and_decay(auto& rng) {
  if constexpr (requires { rng.peek(); }) {
    const Real decay = rng.peek();
    return {rng.exponential(), decay};
  } else {
    const Real e = rng.exponential();
    return {e, exponential(-e)};
  }
}

}  // namespace nullmark
