#pragma once

#include <algorithm>
#include <memory>

#include "harness/kernel/walker.h"
#include "media/base/medium.h"

namespace nullmark {

/// A tracker on a ray along x from the origin, for tests that look at single walks and their events.  Tests may supply their own
/// random numbers.
template <template <class> class Estimator, class Value = Real>
class HandWalked {
 public:
  using E = Estimator<Value>;
  using MediumRay = typename detail::RayDataOf<E, Value>::type;

  struct Outcome {
    Event<Value> event{};
    Value result{};
    Real lookups = 0;
  };

  HandWalked(E tracker, std::shared_ptr<const Medium> medium, Real length, Real looseness = 1, int pieces = 1)
      : estimator(std::move(tracker)), medium_(std::move(medium)), extrema_(medium_->extrema(medium_->bounds())) {
    const Vec3 middle = (medium_->bounds().lo + medium_->bounds().hi) / 2;
    line_ = {{0, middle.y(), middle.z()}, Vec3::UnitX(), 0, length};
    std::vector<Segment> segments;
    for (int i = 0; i < pieces; ++i) {
      const Real a = length * i / pieces, b = i + 1 == pieces ? length : length * (i + 1) / pieces;
      const Extrema bounds = medium_->extrema({line_.at(a), line_.at(b)});
      segments.push_back({a, b, bounds.maximum.maxCoeff() * looseness, bounds});
    }
    ray.bounds.start(std::move(segments));
    if (const auto depth = medium_->optical_depth(line_)) ray.exact_depth = load<Value>(depth->data(), medium_->channels());
    sorted_knots(*medium_, line_, ray.knots);
    prepare_ray<EstimatorTraits<E, Value>>(ray, *medium_, extrema_, line_, line_, medium_->channels());
    prepare();
  }
  HandWalked(const HandWalked&) = delete;
  HandWalked& operator=(const HandWalked&) = delete;

  /// After changes to the ray or the estimator.
  void prepare() {
    if constexpr (requires { estimator.prepare(ray); }) estimator.prepare(ray);
  }

  /// A walk that would take more lookups is given up, as the harness does: its lookups are `most`, and it has no result.
  Outcome walk(auto& rng, Real most = kInfinity) const {
    typename E::Walk walk;
    Real lookups = 0;
    const auto look_up = [&](const auto& at, const Flight& flight) {
      ++lookups;
      return looked_up(at, flight);
    };
    const Flight flight = walk_once(
        estimator, walk, ray, rng, [&] { return lookups <= most; }, look_up);
    if (lookups > most) return {.lookups = most};
    Outcome outcome{.result = estimator.result(walk, ray), .lookups = lookups};
    if constexpr (requires { estimator.event(walk, ray, flight); }) outcome.event = estimator.event(walk, ray, flight);
    return outcome;
  }

  Outcome walk(std::uint64_t sample) const {
    Rng rng(SampleAddress{20170701, 0, sample});
    return walk(rng);
  }

  Value extinction(Real t) const {
    const Vec3 p = line_.at(t);
    std::array<Real, kMaxChannels> out{};
    medium_->extinction({&p.x(), &p.y(), &p.z(), 1}, out.data());
    return load<Value>(out.data(), ray.channels);
  }

  Value transmittance(Real t) const {
    Ray part = line_;
    part.end = t;
    const Spectrum depth = *medium_->optical_depth(part);
    return exponential(Value(-load<Value>(depth.data(), ray.channels)));
  }

  RayProfile profile() const {
    std::vector<Real> ends, rates;
    for (const Segment& segment : ray.bounds.segments()) {
      ends.push_back(segment.end);
      rates.push_back(segment.majorant);
    }
    return RayProfile(
        [this](const Real* t, std::size_t count, Real* out) {
          for (std::size_t i = 0; i < count; ++i) store(extinction(t[i]), out + i * static_cast<std::size_t>(ray.channels));
        },
        ray.channels, ray.knots, ends, rates);
  }

  Theory theory(int channel = 0) const { return estimator.theory(ray, profile(), channel, Quantity::transmittance); }

  E estimator;
  MediumRay ray;

 private:
  Value looked_up(const typename E::Walk& walk, const Flight& at) const {
    if constexpr (requires { estimator.component(walk); }) {
      const int i = estimator.component(walk);
      return medium_->component_extinction(i, line_.at(at.position())) / ray.shares[at.piece()][i];
    } else {
      return extinction(at.position());
    }
  }

  std::shared_ptr<const Medium> medium_;
  Extrema extrema_;
  Ray line_;
};

/// Two-sided tests of means, on fixed streams, are held to so many standard errors: 4e-8 each.
inline constexpr Real kSigmas = 5.5;

/// The optical depth of T = 1/2.
inline constexpr Real kLog2 = 0.6931471805599453;

/// Mean of samples with its standard error.
struct Estimate {
  Real count = 0, sum = 0, squares = 0;

  void add(Real x) {
    ++count;
    sum += x;
    squares += x * x;
  }
  Real mean() const { return sum / count; }
  Real variance() const { return std::max<Real>(0, squares / count - mean() * mean()); }
  Real error() const { return std::sqrt(variance() / count); }
};

}  // namespace nullmark
