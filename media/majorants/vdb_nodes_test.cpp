// Bounds over a volume's nodes: true bounds on contiguous segments, empty nodes in one step, and the cells that are listed found
// on demand.

#include "media/majorants/vdb_nodes.h"

#include "harness/testing/built_media.h"
#include "media/base/channels.h"
#include "media/majorants/ray_bounds.h"
#include "media/volumes/vdb_test.h"

namespace nullmark {
namespace {

using namespace vdb_test;

class VdbNodes : public Vdb {
 protected:
  /// Two blobs of noise, far apart: in nodes (-1, -1, -1) and (3, 0, 0) of 128^3 voxels, and what their filters reach.
  std::shared_ptr<const Medium> blobs(const std::string& interpolation = "trilinear") const {
    auto grid = openvdb::FloatGrid::create(0);
    grid->setName("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.01));
    std::mt19937_64 random(5);
    std::uniform_real_distribution<float> uniform;
    auto accessor = grid->getAccessor();
    for (const int corner : {-30, 390})
      for (int i = 0; i < 24; ++i)
        for (int j = 0; j < 24; ++j)
          for (int k = 0; k < 24; ++k)
            accessor.setValue(Coord(corner + i, (corner < 0 ? -30 : 4) + j, (corner < 0 ? -30 : 4) + k), uniform(random));
    auto data = std::make_shared<const VolumeData>(read_vdb(written(grid), "density"));
    if (interpolation == "nearest") return std::make_shared<FilteredVolume<NearestFilter>>(std::move(data), 50.);
    return std::make_shared<FilteredVolume<TrilinearFilter>>(std::move(data), 50.);
  }

  /// A ray through the medium's box, in both frames.
  static std::pair<Ray, Ray> through(const Medium& medium, std::mt19937_64& random) {
    std::uniform_real_distribution<Real> uniform(0, 1);
    const Box box = medium.bounds();
    const auto point = [&] {
      return Vec3(box.lo + Vec3(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.extent()));
    };
    const Affine to_world = medium.world_to_local().inverse();
    const Vec3 a = to_world * point(), b = to_world * point();
    Ray world{a, (b - a).normalized(), random() % 2 ? -kInfinity : 0, kInfinity};
    const Ray local = clipped(transformed(world, medium.world_to_local()), box);
    world.begin = local.begin;
    world.end = local.end;
    return {world, local};
  }
};

TEST_F(VdbNodes, BoundEveryRay) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (const auto& grey : {blobs(), blobs("nearest")})
    for (const auto& medium :
         {grey, std::shared_ptr<const Medium>(std::make_shared<Spectral>(grey, std::vector<Real>{1, 0, 3}))}) {
      const VdbNodesMajorant nodes(*medium, 1);
      for (int i = 0; i < 500; ++i) {
        const auto [world, local] = through(*medium, random);
        SegmentBuffer listed;
        nodes.segments(world, local, listed);
        ASSERT_FALSE(listed.segments.empty());
        EXPECT_EQ(listed.segments.front().begin, world.begin);
        EXPECT_EQ(listed.segments.back().end, world.end);
        for (std::size_t s = 0; s < listed.segments.size(); ++s) {
          const Segment& segment = listed.segments[s];
          ASSERT_LT(segment.begin, segment.end);
          ASSERT_EQ(segment.begin, s > 0 ? listed.segments[s - 1].end : world.begin);
          for (int k = 0; k < 4; ++k) {
            const Vec3 p = local.at(segment.begin + uniform(random) * (segment.end - segment.begin));
            std::array<Real, kMaxChannels> mu{};
            medium->extinction({&p.x(), &p.y(), &p.z(), 1}, mu.data());
            for (int c = 0; c < medium->channels(); ++c) {
              ASSERT_LE(mu[static_cast<std::size_t>(c)], segment.extinction.maximum[c] * (1 + 1e-12));
              ASSERT_GE(mu[static_cast<std::size_t>(c)], segment.extinction.minimum[c] * (1 - 1e-12));
              ASSERT_LE(mu[static_cast<std::size_t>(c)], segment.majorant * (1 + 1e-12));
            }
          }
        }
        RayBounds bounds;
        Rates rates;
        bounds.start(nodes, world, local);
        bounds.start_rates(world.begin, rates);
        for (Real depth = 0; random() % 8 && rates.reaches(depth);) depth += 0.7;
        ASSERT_EQ(rates.size(), listed.segments.size());
        for (std::size_t s = 0; s < listed.segments.size(); ++s) {
          ASSERT_EQ(rates.end(s), listed.segments[s].end);
          ASSERT_EQ(rates.rate(s), listed.segments[s].majorant);
        }
      }
    }
}

TEST_F(VdbNodes, EmptyNodesAreCrossedInOneStep) {
  const auto medium = blobs();
  const VdbNodesMajorant nodes(*medium, 1);
  // Of 5 x 2 x 2 nodes the blobs lie in two; one cell serves all others.
  EXPECT_EQ(nodes.size().nodes, 20u);
  EXPECT_EQ(nodes.size().cells, 1u + 2 * 4096);
  EXPECT_LT(nodes.size().bytes, 25 * nodes.size().cells + 1000);
  // Along x at the height of the upper blob: the nodes from -1 to 2, then leaves of the fourth.
  Ray world{Vec3(-1, 0.1, 0.1), Vec3::UnitX(), 0, kInfinity};
  const Ray local = clipped(transformed(world, medium->world_to_local()), medium->bounds());
  world.begin = local.begin;
  world.end = local.end;
  SegmentBuffer listed;
  nodes.segments(world, local, listed);
  EXPECT_EQ(listed.segments.size(), 4u + 4u);
  for (std::size_t s = 0; s < 4; ++s) EXPECT_EQ(listed.segments[s].majorant, 0);
  EXPECT_GT(listed.segments[5].majorant, 0);
}

TEST_F(VdbNodes, OtherMediaHaveNone) {
  try {
    VdbNodesMajorant(*constant(1), 1);
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_EQ(error.parameter, "type");
    EXPECT_NE(std::string(error.what()).find("use \"grid\""), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace nullmark
