#pragma once

#include "harness/kernel/estimator_template.h"

namespace nullmark {

/// An honest kernel, for bugs that lie in how it is called.
class WrappedKernel : public Kernel {
 public:
  explicit WrappedKernel(std::unique_ptr<const Kernel> inner) : inner_(std::move(inner)) {}

  bool needs_optical_depth() const override { return inner_->needs_optical_depth(); }
  bool needs_knots() const override { return inner_->needs_knots(); }
  bool states_theory() const override { return inner_->states_theory(); }
  bool answers(Quantity quantity) const override { return inner_->answers(quantity); }
  std::size_t outputs(Quantity quantity, const PreparedRay& context) const override { return inner_->outputs(quantity, context); }
  std::unique_ptr<Workspace> workspace() const override { return inner_->workspace(); }
  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema& extrema, const PreparedRay& context) const override {
    inner_->begin_ray(workspace, medium, extrema, context);
  }
  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    inner_->sample(workspace, medium, context, key, first, count, quantity, out, counters);
  }
  bool flies() const override { return inner_->flies(); }
  bool states_count_law() const override { return inner_->states_count_law(); }
  std::vector<CountLaw> count_law(const Workspace& workspace, const RayProfile& profile) const override {
    return inner_->count_law(workspace, profile);
  }
  Spectrum expected(const Workspace& workspace, const Spectrum& optical_depth, Quantity quantity) const override {
    return inner_->expected(workspace, optical_depth, quantity);
  }
  std::vector<Theory> theory(const Workspace& workspace, const RayProfile& profile, Quantity quantity) const override {
    return inner_->theory(workspace, profile, quantity);
  }

 private:
  std::unique_ptr<const Kernel> inner_;
};

/// `Bug` derives from an honest tracker and has `std::unique_ptr<const Kernel> wrap(std::unique_ptr<const Kernel>) const`.
template <template <class> class Bug>
class WrappedSource final : public EstimatorSource {
 public:
  void parameters(ParameterVisitor& visit) override {
    if constexpr (requires { bug_.parameters(visit); }) bug_.parameters(visit);
    honest_.parameters(visit);
  }
  Guarantee claim(Quantity quantity) const override { return honest_.claim(quantity); }
  SampleRange range(int channels) const override { return honest_.range(channels); }
  bool needs_bound() const override { return honest_.needs_bound(); }
  std::optional<Real> order(Quantity quantity) const override { return honest_.order(quantity); }
  void check(const MatterBounds& medium) const override { honest_.check(medium); }
  std::unique_ptr<const Kernel> kernel(int channels, Precision precision = Precision::float64, bool lanes = true) const override {
    auto honest = honest_.kernel(channels, precision, lanes);
    return honest ? bug_.wrap(std::move(honest)) : nullptr;
  }

 private:
  Bug<Real> bug_;
  EstimatorTemplate<Bug> honest_;
};

}  // namespace nullmark
