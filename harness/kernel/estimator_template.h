#pragma once

#include <string>
#include <type_traits>

#include "harness/kernel/block_kernel.h"
#include "harness/kernel/lane_kernel.h"
#include "harness/kernel/walker.h"

namespace nullmark {

/// Adapts an estimator template to the registry: its parameters live in the grey instance.
template <template <class> class Estimator>
class EstimatorTemplate final : public EstimatorSource {
  using Traits = EstimatorTraits<Estimator<Real>, Real>;
  static constexpr bool kPlanted = requires { Estimator<Real>::kCaughtBy; };
  /// Planted bugs are tried in colour whatever they derive from.
  static constexpr bool kGreyOnly = Traits::kGreyOnly && !kPlanted;
  struct None {};
  using Chromatic = std::conditional_t<kGreyOnly, None, Estimator<Spectrum>>;
  static_assert(expect_estimator<Estimator<Real>, Real>());
  static_assert([] {
    if constexpr (kGreyOnly)
      return true;
    else
      return expect_estimator<Estimator<Spectrum>, Spectrum>();
  }());

 public:
  void parameters(ParameterVisitor& visit) override {
    visit_parameters(grey_, visit);
    visit_parameters(chromatic_, visit);
    if constexpr (kOfFixedWidth) {
      visit_parameters(three_, visit);
      visit_parameters(four_, visit);
    }
    if constexpr (kInLanes) {
      visit_parameters(lanes_, visit);
      visit_parameters(single_, visit);
    }
    if constexpr (kColoursInLanes) {
      visit_parameters(three_in_lanes_, visit);
      visit_parameters(four_in_lanes_, visit);
    }
  }
  Guarantee claim(Quantity quantity) const override { return grey_.claim(quantity); }
  SampleRange range(int channels) const override {
    if constexpr (!kGreyOnly)
      if (channels > 1) return range_of(chromatic_);
    return range_of(grey_);
  }
  bool needs_bound() const override { return Estimator<Real>::kNeedsBound; }
  std::optional<Real> order(Quantity quantity) const override {
    if constexpr (Traits::kOrder) return grey_.order(quantity);
    return std::nullopt;
  }
  void check(const MatterBounds& medium) const override {
    if (kGreyOnly && medium.minimum.size() > 1)
      throw ParameterError("type", std::string(Estimator<Real>::kName) + " takes grey media only; expected one channel, found " +
                                       std::to_string(medium.minimum.size()) +
                                       "; sweep chromatic media in another experiment, or take \"spectral\"");
    if constexpr (Traits::kCheck) grey_.check(medium);
  }
  std::unique_ptr<const Kernel> kernel(int channels, Precision precision = Precision::float64, bool lanes = true) const override {
    if (channels == 1 && lanes && shares_walk(1)) {
      if constexpr (kInLanes) {
        if (precision == Precision::float32) return std::make_unique<LaneKernel<Estimator, float>>(grey_, single_);
        return std::make_unique<LaneKernel<Estimator, Real>>(grey_, lanes_);
      }
    }
    if (precision == Precision::float32) return nullptr;
    if (channels == 1) return std::make_unique<BlockKernel<Estimator, Real>>(grey_, 1);
    if constexpr (kColoursInLanes) {
      constexpr std::size_t kWidth = kNativeLanes<Real>;
      if (channels == 3 && lanes && shares_walk(3))
        return std::make_unique<LaneKernel<Estimator, Real, kWidth, 3>>(three_, three_in_lanes_);
      if (channels == 4 && lanes && shares_walk(4))
        return std::make_unique<LaneKernel<Estimator, Real, kWidth, 4>>(four_, four_in_lanes_);
    }
    if constexpr (kOfFixedWidth) {
      if (channels == 3) return std::make_unique<BlockKernel<Estimator, SpectrumOf<3>>>(three_, channels);
      if (channels == 4) return std::make_unique<BlockKernel<Estimator, SpectrumOf<4>>>(four_, channels);
    }
    if constexpr (kGreyOnly)
      return nullptr;
    else
      return std::make_unique<BlockKernel<Estimator, Spectrum>>(chromatic_, channels);
  }
  Walkers walkers() const override {
    Walkers walkers;
    walkers.grey = std::make_shared<EstimatorWalker<Estimator, Real>>(grey_);
    if constexpr (!kGreyOnly) walkers.chromatic = std::make_shared<EstimatorWalker<Estimator, Spectrum>>(chromatic_);
    if constexpr (kOfFixedWidth && Traits::kEvent) {
      walkers.three = std::make_shared<EstimatorWalker<Estimator, SpectrumOf<3>>>(three_);
      walkers.four = std::make_shared<EstimatorWalker<Estimator, SpectrumOf<4>>>(four_);
    }
    return walkers;
  }

 private:
  template <class E>
  static SampleRange range_of(const E& estimator) {
    if constexpr (requires { estimator.range(); }) return estimator.range();
    return E::kRange;
  }

  /// Whether one flight serves all channels and each of its collisions is a lookup, as in lanes.
  bool shares_walk(int channels) const {
    if constexpr (Traits::kFliesOnce) return grey_.flies_once(channels);
    return true;
  }

  template <class E>
  static void visit_parameters(E& estimator, ParameterVisitor& visit) {
    if constexpr (requires { estimator.parameters(visit); }) estimator.parameters(visit);
  }

  /// Trackers derived from one that runs in lanes may not.
  static constexpr bool kInLanes = runs_in_lanes<Estimator>();
  /// Widths known to the compiler take half the time, and each adds a second to a tracker's compilation: not for planted bugs.
  static constexpr bool kOfFixedWidth = !kGreyOnly && !kPlanted;
  static constexpr bool kColoursInLanes = kInLanes && kOfFixedWidth;

  Estimator<Real> grey_;
  [[no_unique_address]] std::conditional_t<kOfFixedWidth, Estimator<SpectrumOf<3>>, None> three_;
  [[no_unique_address]] std::conditional_t<kOfFixedWidth, Estimator<SpectrumOf<4>>, None> four_;
  [[no_unique_address]] Chromatic chromatic_;
  [[no_unique_address]] std::conditional_t<kInLanes, LanesOf<Estimator, Real>, None> lanes_;
  [[no_unique_address]] std::conditional_t<kInLanes, LanesOf<Estimator, float>, None> single_;
  [[no_unique_address]] std::conditional_t<kColoursInLanes, LanesOf<Estimator, Real, 3>, None> three_in_lanes_;
  [[no_unique_address]] std::conditional_t<kColoursInLanes, LanesOf<Estimator, Real, 4>, None> four_in_lanes_;
};

}  // namespace nullmark
