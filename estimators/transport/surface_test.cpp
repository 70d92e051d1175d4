#include "estimators/transport/surface.h"

#include <gtest/gtest.h>

#include <vector>

#include "estimators/transport/phase.h"
#include "estimators/walk/rng.h"

namespace nullmark {
namespace {

Real distance(const Surface& surface, const Ray& ray) { return first_hit({&surface, 1}, ray).distance; }

Ray towards(const Vec3& from, const Vec3& direction, Real begin = 0, Real end = kInfinity) {
  return {from, direction.normalized(), begin, end};
}

TEST(Surface, PlanesAreMetFromBothSidesAndMissedByParallels) {
  const Surface plane{Plane{{0, 0, 2}, {0, 0, 3}}, {}};
  EXPECT_DOUBLE_EQ(distance(plane, towards({5, 5, 0}, {0, 0, 1})), 2);
  EXPECT_DOUBLE_EQ(distance(plane, towards({5, 5, 6}, {0, 0, -1})), 4);
  EXPECT_DOUBLE_EQ(distance(plane, towards({0, 0, 0}, {0, 3, 4})), 2.5);
  EXPECT_EQ(distance(plane, towards({0, 0, 0}, {0, 0, -1})), kInfinity);
  EXPECT_EQ(distance(plane, towards({0, 0, 0}, {1, 0, 0})), kInfinity);
  EXPECT_EQ(distance(plane, towards({0, 0, 2}, {1, 1, 0})), kInfinity);
}

TEST(Surface, BoxesAreMetFromOutsideAndInside) {
  const Surface box{Box{{0, 0, 0}, {1, 2, 3}}, {}};
  EXPECT_DOUBLE_EQ(distance(box, towards({-2, 1, 1}, {1, 0, 0})), 2);
  EXPECT_DOUBLE_EQ(distance(box, towards({0.25, 1, 1}, {1, 0, 0})), 0.75);
  EXPECT_DOUBLE_EQ(distance(box, towards({0.5, 1, 1}, {0, 0, -1})), 1);
  EXPECT_DOUBLE_EQ(distance(box, towards({-1, 0.5, 1}, {1, 1, 0})), std::sqrt(2));
  EXPECT_EQ(distance(box, towards({-2, 1, 1}, {-1, 0, 0})), kInfinity);
  EXPECT_EQ(distance(box, towards({-2, 5, 1}, {1, 0, 0})), kInfinity);
  EXPECT_EQ(distance(box, towards({-1, 1.5, 1}, {1, 1, 0})), kInfinity);
}

TEST(Surface, SpheresAreMetFromOutsideAndInside) {
  const Surface sphere{Sphere{{1, 0, 0}, 2}, {}};
  EXPECT_DOUBLE_EQ(distance(sphere, towards({-4, 0, 0}, {1, 0, 0})), 3);
  EXPECT_DOUBLE_EQ(distance(sphere, towards({1, 0, 0}, {0, 1, 0})), 2);
  EXPECT_DOUBLE_EQ(distance(sphere, towards({2, 0, 0}, {1, 0, 0})), 1);
  EXPECT_DOUBLE_EQ(distance(sphere, towards({-4, 1, 0}, {1, 0, 0})), 5 - std::sqrt(3));
  EXPECT_EQ(distance(sphere, towards({-4, 0, 0}, {-1, 0, 0})), kInfinity);
  EXPECT_EQ(distance(sphere, towards({-4, 2.5, 0}, {1, 0, 0})), kInfinity);
}

TEST(Surface, AFarSphereKeepsItsDigits) {
  const Surface sphere{Sphere{{0, 0, 0}, 1}, {}};
  EXPECT_NEAR(distance(sphere, towards({-1e8, 0.6, 0}, {1, 0, 0})), 1e8 - 0.8, 2e-8);
}

TEST(Surface, OnlyHitsWithinTheRayCountAndTheFirstOneWins) {
  const std::vector<Surface> surfaces = {{Plane{{0, 0, 5}, {0, 0, 1}}, {}}, {Sphere{{0, 0, 3}, 1}, {}}};
  SurfaceHit hit = first_hit(surfaces, towards({0, 0, 0}, {0, 0, 1}));
  EXPECT_DOUBLE_EQ(hit.distance, 2);
  EXPECT_EQ(hit.surface, &surfaces[1]);
  hit = first_hit(surfaces, towards({0, 0, 0}, {0, 0, 1}, 3));  // from inside the sphere
  EXPECT_DOUBLE_EQ(hit.distance, 4);
  hit = first_hit(surfaces, towards({0, 0, 0}, {0, 0, 1}, 4.5));
  EXPECT_DOUBLE_EQ(hit.distance, 5);
  EXPECT_EQ(hit.surface, &surfaces[0]);
  EXPECT_EQ(first_hit(surfaces, towards({0, 0, 0}, {0, 0, 1}, 0, 1.5)).surface, nullptr);
  EXPECT_EQ(first_hit({}, towards({0, 0, 0}, {0, 0, 1})).distance, kInfinity);
}

/// From computed points of a sphere, off it by rounding: outwards nothing is met, inwards the far side at 2 r cos.
TEST(Surface, ARayThatStartsOnASphereDoesNotMeetItThere) {
  const Sphere sphere{{0.3, -7, 11}, 0.7};
  const Surface surface{sphere, {}};
  Rng rng(SampleAddress{3, 0, 0});
  for (int i = 0; i < 20000; ++i) {
    const Vec3 normal = Isotropic{}.sample(Vec3::UnitZ(), rng), direction = Isotropic{}.sample(Vec3::UnitZ(), rng);
    const Ray ray = towards(sphere.center + sphere.radius * normal, direction);
    const Real inwards = -normal.dot(ray.direction);
    if (inwards > 1e-3) {
      EXPECT_NEAR(distance(surface, ray), 2 * sphere.radius * inwards, 1e-11);
    }
    if (inwards < -1e-3) {
      EXPECT_EQ(distance(surface, ray), kInfinity);
    }
  }
}

TEST(Surface, ARayThatStartsOnAPlaneOrABoxDoesNotMeetItThere) {
  const Plane plane{{0.1, 0.2, 0.3}, Vec3(1, 2, -3)};
  const Box box{{-0.1, 0.2, 0.3}, {1.7, 2.3, 3.1}};
  const Surface wall{plane, {}}, room{box, {}};
  const Frame frame(plane.normal.normalized());
  Rng rng(SampleAddress{4, 0, 0});
  for (int i = 0; i < 20000; ++i) {
    const Vec3 direction = Isotropic{}.sample(Vec3::UnitZ(), rng);
    const Real u = rng.uniform(), v = rng.uniform();
    EXPECT_EQ(distance(wall, towards(plane.point + (10 * u - 5) * frame.first + (10 * v - 5) * frame.second, direction)),
              kInfinity);
    const int axis = i % 3;
    Vec3 start = box.lo + Vec3(u, v, rng.uniform()).cwiseProduct(box.extent());
    start[axis] = i % 2 ? box.lo[axis] : box.hi[axis];
    const bool inwards = (direction[axis] > 0) == (i % 2 == 1);
    const Ray ray = towards(start, direction);
    const Real t = distance(room, ray);
    ASSERT_EQ(std::isfinite(t), inwards);
    if (!inwards) continue;
    const Vec3 end = ray.at(t);
    EXPECT_LT(((end - box.lo).cwiseProduct(box.hi - end)).cwiseAbs().minCoeff(), 1e-14);  // on another face
    EXPECT_GT(t, 0);
  }
}

}  // namespace
}  // namespace nullmark
