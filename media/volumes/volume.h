#pragma once

#include <memory>
#include <string>

#include "media/base/registry.h"
#include "media/volumes/brick_grid_summary.h"
#include "media/volumes/vdb_reader.h"

namespace nullmark {

/// How a filter turns voxels into a field: value(x) = sum over voxels i of v_i k(x - i), per axis.  `first` and `last` tell the
/// voxels that a point at x may touch, `mass(u)` = int_-inf^u k, planes of non-smoothness lie at integers + kPlane, and the field
/// reaches kReach beyond the outermost active voxels.
struct TrilinearFilter {
  static constexpr Real kReach = 1, kPlane = 0;
  static constexpr int kDegree = 3;
  static Real value(const BrickGrid& grid, Real x, Real y, Real z) { return grid.trilinear(x, y, z); }
  template <class T, std::size_t N>
  static Lanes<T, N> value(const BrickGrid& grid, Lanes<T, N> x, Lanes<T, N> y, Lanes<T, N> z) {
    return grid.trilinear(x, y, z);
  }
  static int first(Real x) { return BrickGrid::floored(x); }
  static int last(Real x) { return BrickGrid::floored(x) + 1; }
  static Real mass(Real u) {
    u = std::clamp<Real>(u, -1, 1);
    return u < 0 ? (1 + u) * (1 + u) / 2 : 1 - (1 - u) * (1 - u) / 2;
  }
};

struct NearestFilter {
  static constexpr Real kReach = 0.5, kPlane = 0.5;
  static constexpr int kDegree = 0;
  static Real value(const BrickGrid& grid, Real x, Real y, Real z) { return grid.nearest(x, y, z); }
  static int first(Real x) { return BrickGrid::rounded(x); }
  static int last(Real x) { return BrickGrid::rounded(x); }
  static Real mass(Real u) { return std::clamp<Real>(u + 0.5, 0, 1); }
};

/// Extinction in a voxel grid: mu = extinction_per_value * value, 1/length.  Local frame: voxel indices, centres at integers.
/// Bounds are the active voxels' box and the filter's reach around it; beyond is vacuum, whatever the background, which shows
/// only within the box.
class Volume : public Medium {
 public:
  Volume(std::shared_ptr<const VolumeData> data, Real extinction_per_value)
      : data_(std::move(data)), scale_(extinction_per_value), world_to_local_(data_->index_to_world.inverse()) {}

  const VolumeData& data() const { return *data_; }
  Affine world_to_local() const override { return world_to_local_; }
  std::uint64_t content_hash() const override { return data_->content_hash; }
  bool has_nodes() const override { return true; }

 protected:
  std::shared_ptr<const VolumeData> data_;
  Real scale_;

 private:
  Affine world_to_local_;
};

template <class Filter>
class FilteredVolume final : public Volume {
 public:
  using Volume::Volume;

  Box bounds() const override {
    const Vec3 reach = Vec3::Constant(Filter::kReach);
    return {data_->active.lo.template cast<Real>() - reach, data_->active.hi.template cast<Real>() + reach};
  }

  void extinction(const Points& points, Real* out) const override {
    const BrickGrid& grid = data_->values;
    for (std::size_t i = whole_packs<kNativeLanes<Real>>(points, out); i < points.size; ++i)
      out[i] = scale_ * Filter::value(grid, points.x[i], points.y[i], points.z[i]);
  }

  void extinction(const SinglePoints& points, float* out) const override {
    const std::size_t done = whole_packs<kNativeLanes<float>>(points, out);
    const std::size_t left = points.size - done;
    const SinglePoints rest{points.x + done, points.y + done, points.z + done, left};
    if (whole_packs<1>(rest, out + done) < left) Medium::extinction(rest, out + done);
  }

  Extrema extrema(const Box& box) const override {
    const Box whole = bounds();
    const Box cut{box.lo.cwiseMax(whole.lo), box.hi.cwiseMin(whole.hi)};
    if ((cut.lo.array() > cut.hi.array()).any()) return Extrema::grey(0, 0, 0);
    const IndexBox touched{cut.lo.unaryExpr(&Filter::first), cut.hi.unaryExpr(&Filter::last)};
    // The weights make the average the field's own, int mu / volume.
    const auto weights = [&](int axis, int i) { return Filter::mass(cut.hi[axis] - i) - Filter::mass(cut.lo[axis] - i); };
    const RangeSummary found = data_->values.summary(touched, weights, cut.extent().prod());
    return Extrema::grey(scale_ * found.minimum, scale_ * found.average, scale_ * found.maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const override {
    const Box whole = bounds();
    const Ray inside = clipped(ray, whole);
    if (!(inside.length() > 0)) return;
    for (int axis = 0; axis < 3; ++axis) {
      const Real o = ray.origin[axis], d = ray.direction[axis];
      if (d == 0) continue;
      const Real a = inside.at(inside.begin)[axis], b = inside.at(inside.end)[axis];
      // The two planes beyond the ends are tried as well, for rounding may have moved the ends across them.
      const Real first = std::max(whole.lo[axis], std::floor(std::min(a, b)) - Filter::kPlane);
      const Real last = std::min(whole.hi[axis], std::ceil(std::max(a, b)) + Filter::kPlane);
      const auto planes = static_cast<std::int64_t>(last - first) + 1;
      for (std::int64_t i = 0; i < planes; ++i) {
        const Real at = (first + static_cast<Real>(i) - o) / d;
        if (at > ray.begin && at < ray.end && at >= inside.begin && at <= inside.end) t.push_back(at);
      }
    }
  }

  std::optional<int> polynomial_degree() const override { return Filter::kDegree; }

 private:
  /// Answers as many points as fill registers of N lanes, where the filter works in lanes; tells how many.
  template <std::size_t N, class T>
  std::size_t whole_packs(const BasicPoints<T>& points, T* out) const {
    std::size_t i = 0;
    if constexpr (requires(const BrickGrid& grid, Lanes<T, N> x) { Filter::value(grid, x, x, x); }) {
      if (!data_->values.fits_lanes()) return 0;
      using Pack = Lanes<T, N>;
      for (; i + N <= points.size; i += N)
        (Pack(scale_) *
         Filter::value(data_->values, Pack::load(points.x + i), Pack::load(points.y + i), Pack::load(points.z + i)))
            .store(out + i);
    }
    return i;
  }
};

/// The configuration's `vdb` medium.
class VdbSource final : public MediumSource {
 public:
  static constexpr const char* kName = "vdb";
  static constexpr const char* kSummary = "extinction from a scalar grid of an OpenVDB file";
  static constexpr const char* kSource = "Museth 2013, VDB: High-resolution sparse volumes with dynamic topology";

  void parameters(ParameterVisitor& visit) override {
    visit.text("file", file_, "path of the .vdb file");
    visit.text("grid", grid_, "name of the grid, name[n] (from 0, in file order) where names repeat");
    visit.number("extinction_per_value", extinction_per_value_, Range::non_negative(), "1/length",
                 "extinction of a voxel value of 1");
    visit.number("optical_depth", optical_depth_, Range::non_negative(), "",
                 "average extinction times the diagonal of the bounds, in place of extinction_per_value; 0: not used");
    visit.choice("interpolation", interpolation_, {"trilinear", "nearest"}, "field between voxel centres");
  }

  std::shared_ptr<const Medium> build() const override {
    if (optical_depth_ > 0 && extinction_per_value_ != 1)
      throw ParameterError("optical_depth", "scales the volume as \"extinction_per_value\" does; expected one of them");
    auto data = std::make_shared<const VolumeData>(read_vdb(file_, grid_));
    if (interpolation_ == "nearest") return scaled<NearestFilter>(std::move(data));
    return scaled<TrilinearFilter>(std::move(data));
  }

 private:
  template <class Filter>
  std::shared_ptr<const Medium> scaled(std::shared_ptr<const VolumeData> data) const {
    Real scale = extinction_per_value_;
    if (optical_depth_ > 0) {
      const FilteredVolume<Filter> unit(data, 1);
      const Box bounds = unit.bounds();
      const Real depth = unit.extrema(bounds).average[0] * (data->index_to_world.linear() * bounds.extent()).norm();
      if (!(depth > 0)) throw ParameterError("optical_depth", "a volume without extinction has none; expected 0");
      scale = optical_depth_ / depth;
    }
    return std::make_shared<FilteredVolume<Filter>>(std::move(data), scale);
  }

  std::string file_, grid_ = "density", interpolation_ = "trilinear";
  Real extinction_per_value_ = 1, optical_depth_ = 0;
};

}  // namespace nullmark
