#include "harness/kernel/difference_kernel.h"

namespace nullmark {
namespace {

/// Makes other streams of a key: the digits of the golden ratio.
constexpr std::uint64_t kOtherStreams = 0x9e3779b97f4a7c15;

class DifferenceKernel final : public Kernel {
  struct Both final : Workspace {
    std::unique_ptr<Workspace> first, second;
    SampleBlock subtracted;
  };

 public:
  DifferenceKernel(std::shared_ptr<const Kernel> first, std::shared_ptr<const Kernel> second)
      : first_(std::move(first)), second_(std::move(second)) {}

  bool needs_optical_depth() const override { return first_->needs_optical_depth() || second_->needs_optical_depth(); }
  bool needs_knots() const override { return first_->needs_knots() || second_->needs_knots(); }
  bool states_theory() const override { return false; }
  bool flies() const override { return false; }
  std::vector<Theory> theory(const Workspace&, const RayProfile&, Quantity) const override { return {}; }
  bool answers(Quantity quantity) const override {
    const bool single =
        quantity == Quantity::transmittance || quantity == Quantity::optical_depth || quantity == Quantity::radiance;
    return single && first_->answers(quantity) && second_->answers(quantity);
  }

  std::unique_ptr<Workspace> workspace() const override {
    auto both = std::make_unique<Both>();
    both->first = first_->workspace();
    both->second = second_->workspace();
    return both;
  }
  std::size_t outputs(Quantity quantity, const PreparedRay& ray) const override { return first_->outputs(quantity, ray); }

  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema& extrema, const PreparedRay& ray) const override {
    Both& both = static_cast<Both&>(workspace);
    first_->begin_ray(*both.first, medium, extrema, ray);
    second_->begin_ray(*both.second, medium, extrema, ray);
  }

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& ray, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    Both& both = static_cast<Both&>(workspace);
    for (Workspace* part : {both.first.get(), both.second.get()}) {
      part->stop = both.stop;
      part->most_lookups = both.most_lookups;
    }
    both.first->recording = both.recording;
    first_->sample(*both.first, medium, ray, key, first, count, quantity, out, counters);
    Counters subtracted;
    second_->sample(*both.second, medium, ray, key ^ kOtherStreams, first, count, quantity, both.subtracted, subtracted);
    subtracted.samples = 0;
    counters += subtracted;
    for (std::size_t i = 0; i < out.values.size(); ++i) out.values[i] -= both.subtracted.values[i];
    for (std::size_t i = 0; i < count; ++i) out.lookups[i] += both.subtracted.lookups[i];
  }

  Spectrum expected(const Workspace&, const Spectrum& optical_depth, Quantity) const override {
    return Spectrum::Zero(optical_depth.size());
  }

 private:
  std::shared_ptr<const Kernel> first_, second_;
};

}  // namespace

std::unique_ptr<const Kernel> make_difference_kernel(std::shared_ptr<const Kernel> first, std::shared_ptr<const Kernel> second) {
  return std::make_unique<DifferenceKernel>(std::move(first), std::move(second));
}

}  // namespace nullmark
