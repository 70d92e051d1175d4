#include "harness/run/medium_contract.h"

#include <gtest/gtest.h>

#include <cmath>

#include "harness/registry/components.h"

namespace nullmark {
namespace {

TEST(MediumContract, IsKeptByEveryProceduralMedium) {
  for (const ComponentInfo& medium : registered(ComponentKind::medium)) {
    if (medium.name == "vdb" || medium.name == "canonical") continue;
    for (const ContractFinding& finding : check_medium(Json(medium.name)))
      EXPECT_TRUE(finding.kept) << finding.what << ": " << finding.detail;
  }
}

/// Linear in x over the unit box, and wrong in one thing.
class Liar final : public Medium {
 public:
  enum class Lie { none, negative, block, bound, average, knots, depth, inverse };

  explicit Liar(Lie lie) : lie_(lie) {}

  Box bounds() const override { return {Vec3::Zero(), Vec3::Ones()}; }
  void extinction(const Points& points, Real* out) const override {
    for (std::size_t i = 0; i < points.size; ++i)
      out[i] = points.x[i] + (lie_ == Lie::block && points.size > 1 ? 1e-12 : 0) - (lie_ == Lie::negative ? 1e-3 : 0);
  }
  Extrema extrema(const Box& box) const override {
    const Real low = box.lo[0], high = box.hi[0] - (lie_ == Lie::bound ? 0.01 * box.extent()[0] : 0);
    return Extrema::grey(low, lie_ == Lie::average ? high + 0.01 : (low + high) / 2, high);
  }
  void knots(const Ray& ray, std::vector<Real>& t) const override {
    if (lie_ == Lie::knots) t.push_back(ray.end + 1);
  }
  std::optional<Spectrum> optical_depth(const Ray& ray) const override {
    const Real depth = (ray.at(ray.begin)[0] + ray.at(ray.end)[0]) / 2 * (ray.end - ray.begin);
    return Spectrum::Constant(1, depth * (lie_ == Lie::depth ? 1 + 1e-6 : 1));
  }
  std::optional<Real> distance_at_depth(const Ray& ray, Real depth) const override {
    const Real x = ray.at(ray.begin)[0], slope = ray.direction[0];
    const Real s = slope == 0 ? depth / x : (std::sqrt(x * x + 2 * slope * depth) - x) / slope;
    return ray.begin + s * (lie_ == Lie::inverse ? 1 + 1e-6 : 1);
  }

 private:
  Lie lie_;
};

TEST(MediumContract, AMediumThatBreaksAPromiseIsTold) {
  const auto broken = [](Liar::Lie lie) {
    std::vector<std::string> what;
    for (const ContractFinding& finding : check_medium(Liar(lie)))
      if (!finding.kept) what.push_back(finding.what);
    return what;
  };
  using Words = std::vector<std::string>;
  EXPECT_EQ(broken(Liar::Lie::none), Words{});
  EXPECT_EQ(broken(Liar::Lie::negative).front(), "extinction is finite and not negative");
  EXPECT_EQ(broken(Liar::Lie::block), Words{"a block of lookups gives what single lookups give"});
  EXPECT_EQ(broken(Liar::Lie::bound).front(), "extrema bound the extinction");
  EXPECT_EQ(broken(Liar::Lie::average), Words{"the average lies between the extrema"});
  EXPECT_EQ(broken(Liar::Lie::knots).front(), "knots lie inside their ray");
  EXPECT_EQ(broken(Liar::Lie::depth).front(), "the closed form of the optical depth is the integral of the extinction");
  EXPECT_EQ(broken(Liar::Lie::inverse), Words{"the distance at a depth leads back to the depth"});
}

}  // namespace
}  // namespace nullmark
