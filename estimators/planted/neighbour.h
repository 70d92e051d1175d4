#pragma once

#include "estimators/planted/wrapped.h"
#include "estimators/ratio.h"

namespace nullmark {

/// Looks the medium up on a ray moved sideways.
class NeighbourRay final : public WrappedKernel {
 public:
  NeighbourRay(std::unique_ptr<const Kernel> inner, const Vec3& shift) : WrappedKernel(std::move(inner)), shift_(shift) {}

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    PreparedRay moved = context;
    moved.local.origin += medium.world_to_local().linear() * shift_;
    const bool stays =
        inside(medium.bounds(), moved.local.at(moved.local.begin)) && inside(medium.bounds(), moved.local.at(moved.local.end));
    WrappedKernel::sample(workspace, medium, stays ? moved : context, key, first, count, quantity, out, counters);
  }

 private:
  static bool inside(const Box& box, const Vec3& p) {
    const Vec3 slack = 1e-9 * box.extent();
    return (p.array() >= (box.lo - slack).array()).all() && (p.array() <= (box.hi + slack).array()).all();
  }

  Vec3 shift_;
};

/// Ratio tracking on the ray of the next pixel: an image index that is off by one.  Rays whose neighbour leaves the medium keep
/// their place.  An image's mean hardly changes; its pixels do.  Meant for parallel rays and one bound over the medium.
template <class Value>
struct PlantedNeighbour : RatioTracking<Value> {
  static constexpr const char* kName = "planted_neighbour";
  static constexpr const char* kSummary = "wrong: ratio tracking on the ray of another pixel";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "groups";

  Vec3 shift{0.0625, 0, 0};

  void parameters(ParameterVisitor& visit) {
    visit.point("shift", shift, "length", "from a ray to the one that is sampled in its place");
  }

  std::unique_ptr<const Kernel> wrap(std::unique_ptr<const Kernel> honest) const {
    return std::make_unique<NeighbourRay>(std::move(honest), shift);
  }
};

}  // namespace nullmark
