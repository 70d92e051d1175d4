// A dense grid that is written is read as it was: its values, its map, and all of its box, whatever is 0.

#include "media/volumes/vdb_test.h"
#include "media/volumes/vdb_writer.h"

namespace nullmark {
namespace {

using namespace vdb_test;

TEST_F(Vdb, DenseGridsAreReadAsTheyWereWritten) {
  const Index3 shape(9, 17, 5);
  std::vector<float> values;
  std::mt19937 random(3);
  for (int i = 0; i < shape.prod(); ++i) values.push_back(random() % 3 == 0 ? 0.f : static_cast<float>(random() % 1000) / 7);
  // The corners too.
  values.front() = values.back() = 0;
  const Affine map = Affine(Eigen::Translation<Real, 3>(1, -2, 3)) * Eigen::Scaling(Vec3(0.1, 0.25, 0.5));
  write_dense_vdb(path(), shape, values, map);
  const VolumeData data = read_vdb(path(), "density");
  EXPECT_EQ(data.active.lo, Index3::Zero());
  EXPECT_EQ(data.active.hi, shape - Index3::Ones());
  std::size_t at = 0;
  for (int k = 0; k < shape[2]; ++k)
    for (int j = 0; j < shape[1]; ++j)
      for (int i = 0; i < shape[0]; ++i) ASSERT_EQ(data.values.value(i, j, k), values[at++]);
  EXPECT_LT((data.index_to_world.matrix() - map.matrix()).norm(), 1e-12);
}

TEST_F(Vdb, ADenseGridOfZerosKeepsItsBox) {
  write_dense_vdb(path(), Index3(4, 4, 4), std::vector<float>(64), Affine::Identity());
  EXPECT_EQ(read_vdb(path(), "density").active.hi, Index3::Constant(3));
}

}  // namespace
}  // namespace nullmark
