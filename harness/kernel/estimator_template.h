#pragma once

#include <type_traits>

#include "harness/kernel/block_kernel.h"
#include "harness/kernel/lane_kernel.h"
#include "harness/kernel/walker.h"

namespace nullmark {

/// Adapts an estimator template to the registry: its parameters live in the grey instance.
template <template <class> class Estimator>
class EstimatorTemplate final : public EstimatorSource {
  using Traits = EstimatorTraits<Estimator<Real>, Real>;
  static_assert(expect_estimator<Estimator<Real>, Real>() && expect_estimator<Estimator<Spectrum>, Spectrum>());

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
  }
  Guarantee claim(Quantity quantity) const override { return grey_.claim(quantity); }
  SampleRange range(int channels) const override { return channels == 1 ? range_of(grey_) : range_of(chromatic_); }
  bool needs_bound() const override { return Estimator<Real>::kNeedsBound; }
  std::optional<Real> order(Quantity quantity) const override {
    if constexpr (Traits::kOrder) return grey_.order(quantity);
    return std::nullopt;
  }
  void check(const MatterBounds& medium) const override {
    if constexpr (Traits::kCheck) grey_.check(medium);
  }
  std::unique_ptr<const Kernel> kernel(int channels, Precision precision = Precision::float64, bool lanes = true) const override {
    if (channels == 1 && lanes) {
      if constexpr (kInLanes) {
        if (precision == Precision::float32) return std::make_unique<LaneKernel<Estimator, float>>(grey_, single_);
        return std::make_unique<LaneKernel<Estimator, Real>>(grey_, lanes_);
      }
    }
    if (precision == Precision::float32) return nullptr;
    if (channels == 1) return std::make_unique<BlockKernel<Estimator, Real>>(grey_, 1);
    if constexpr (kOfFixedWidth) {
      if (channels == 3) return std::make_unique<BlockKernel<Estimator, SpectrumOf<3>>>(three_, channels);
      if (channels == 4) return std::make_unique<BlockKernel<Estimator, SpectrumOf<4>>>(four_, channels);
    }
    return std::make_unique<BlockKernel<Estimator, Spectrum>>(chromatic_, channels);
  }
  Walkers walkers() const override {
    return {std::make_shared<EstimatorWalker<Estimator, Real>>(grey_),
            std::make_shared<EstimatorWalker<Estimator, Spectrum>>(chromatic_)};
  }

 private:
  template <class E>
  static SampleRange range_of(const E& estimator) {
    if constexpr (requires { estimator.range(); }) return estimator.range();
    return E::kRange;
  }

  template <class E>
  static void visit_parameters(E& estimator, ParameterVisitor& visit) {
    if constexpr (requires { estimator.parameters(visit); }) estimator.parameters(visit);
  }

  /// Trackers derived from one that runs in lanes may not.
  static constexpr bool kInLanes = runs_in_lanes<Estimator>();
  /// Widths known to the compiler take half the time, and each adds a second to a tracker's compilation: not for planted bugs.
  static constexpr bool kOfFixedWidth = !requires { Estimator<Real>::kCaughtBy; };
  struct None {};

  Estimator<Real> grey_;
  [[no_unique_address]] std::conditional_t<kOfFixedWidth, Estimator<SpectrumOf<3>>, None> three_;
  [[no_unique_address]] std::conditional_t<kOfFixedWidth, Estimator<SpectrumOf<4>>, None> four_;
  Estimator<Spectrum> chromatic_;
  [[no_unique_address]] std::conditional_t<kInLanes, LanesOf<Estimator, Real>, None> lanes_;
  [[no_unique_address]] std::conditional_t<kInLanes, LanesOf<Estimator, float>, None> single_;
};

}  // namespace nullmark
