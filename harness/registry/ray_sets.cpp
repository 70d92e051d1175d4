#include "harness/registry/ray_sets.h"

#include <array>
#include <cmath>
#include <numbers>

#include "estimators/walk/rng.h"

namespace nullmark {
namespace {

Vec3 normalised(const Vec3& v, const char* parameter) {
  const Real length = v.norm();
  if (!(length > 0) || !std::isfinite(length))
    throw ParameterError(parameter, "direction has no length; expected a finite vector other than 0");
  return v / length;
}

/// Uniform on the unit sphere.
Vec3 random_direction(Rng& rng) {
  const Real z = 1 - 2 * rng.uniform(), phi = 2 * std::numbers::pi * rng.uniform(), r = std::sqrt(std::max<Real>(0, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

std::size_t pixels(int width, int height) { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }

struct SingleRay final : RaySetSource {
  static constexpr const char* kName = "single";
  static constexpr const char* kSummary = "one ray, between two points";
  static constexpr const char* kSource = "";

  Vec3 from{0, 0.5, 0.5}, to{1, 0.5, 0.5};

  void parameters(ParameterVisitor& visit) override {
    visit.point("from", from, "length", "start of the ray");
    visit.point("to", to, "length", "end of the ray");
  }
  std::size_t count() const override { return 1; }
  RaySet rays(const Box&) const override { return {{Ray{from, normalised(to - from, "to"), 0, (to - from).norm()}}, 0, 0}; }
};

struct Orthographic final : RaySetSource {
  static constexpr const char* kName = "orthographic";
  static constexpr const char* kSummary = "parallel rays through the pixel centres of the bounds' face, along an axis";
  static constexpr const char* kSource = "";

  int width = 64, height = 64;
  std::string axis = "z";

  void parameters(ParameterVisitor& visit) override {
    visit.integer("width", width, 1, 16384, "pixels across");
    visit.integer("height", height, 1, 16384, "pixels up");
    visit.choice("axis", axis, {"x", "y", "z"}, "direction of the rays; x looks over (y, z), y over (x, z), z over (x, y)");
  }
  std::size_t count() const override { return pixels(width, height); }
  RaySet rays(const Box& bounds) const override {
    const int along = axis[0] - 'x', across = along == 0 ? 1 : 0, up = along == 2 ? 1 : 2;
    RaySet set{{}, width, height};
    set.rays.reserve(count());
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) {
        Vec3 origin = bounds.lo;
        origin[across] += (i + 0.5) / width * bounds.extent()[across];
        origin[up] += (j + 0.5) / height * bounds.extent()[up];
        set.rays.push_back({origin, Vec3::Unit(along), 0, bounds.extent()[along]});
      }
    return set;
  }
};

struct Perspective final : RaySetSource {
  static constexpr const char* kName = "perspective";
  static constexpr const char* kSummary = "rays from an eye through pixel centres towards the middle of the bounds";
  static constexpr const char* kSource = "";

  int width = 64, height = 64;
  Real field_of_view = 40, distance = 1.6;
  Vec3 view{1, 0.4, 1.2}, up{0, 1, 0};

  void parameters(ParameterVisitor& visit) override {
    visit.integer("width", width, 1, 16384, "pixels across");
    visit.integer("height", height, 1, 16384, "pixels up");
    visit.number("field_of_view", field_of_view, Range{0, 170, true}, "degrees", "vertical angle");
    visit.number("distance", distance, Range::positive(), "", "of the eye from the bounds' middle, in diagonals of the bounds");
    visit.point("view", view, "", "direction from the middle of the bounds to the eye");
    visit.point("up", up, "", "upward direction");
  }
  std::size_t count() const override { return pixels(width, height); }
  RaySet rays(const Box& bounds) const override {
    const Vec3 back = normalised(view, "view");
    const Vec3 eye = (bounds.lo + bounds.hi) / 2 + distance * bounds.extent().norm() * back;
    const Vec3 right = normalised(up.cross(back), "up"), above = back.cross(right);
    const Real scale = std::tan(field_of_view / 360 * std::numbers::pi);
    RaySet set{{}, width, height};
    set.rays.reserve(count());
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) {
        const Real a = (2 * (i + 0.5) / width - 1) * scale * width / height, b = (2 * (j + 0.5) / height - 1) * scale;
        set.rays.push_back({eye, (a * right + b * above - back).normalized(), 0, kInfinity});
      }
    return set;
  }
};

/// Isotropic uniform lines: a direction uniform on the sphere and a point uniform on the disc across it that covers the bounds'
/// sphere.
struct Chords final : RaySetSource {
  static constexpr const char* kName = "chords";
  static constexpr const char* kSummary = "isotropic random lines that hit the bounds";
  static constexpr const char* kSource = "Santalo, Integral geometry";

  int number = 1024, seed = 1;

  void parameters(ParameterVisitor& visit) override {
    visit.integer("count", number, 1, 100'000'000, "rays");
    visit.integer("seed", seed, 0, 2'147'483'647, "of the lines");
  }
  std::size_t count() const override { return static_cast<std::size_t>(number); }
  RaySet rays(const Box& bounds) const override {
    RaySet set;
    const Vec3 centre = (bounds.lo + bounds.hi) / 2;
    const Real radius = bounds.extent().norm() / 2;
    for (std::uint64_t line = 0; set.rays.size() < count(); ++line) {
      Rng rng(SampleAddress{static_cast<std::uint64_t>(seed), 0, line});
      const Vec3 direction = random_direction(rng);
      const Vec3 side = direction.unitOrthogonal(), other = direction.cross(side);
      const Real r = radius * std::sqrt(rng.uniform()), phi = 2 * std::numbers::pi * rng.uniform();
      const Ray ray{centre + r * (std::cos(phi) * side + std::sin(phi) * other) - radius * direction, direction, 0, 2 * radius};
      if (clipped(ray, bounds).length() > 0) set.rays.push_back(ray);
    }
    return set;
  }
};

struct Inside final : RaySetSource {
  static constexpr const char* kName = "inside";
  static constexpr const char* kSummary = "rays that start at uniform points inside the bounds, in isotropic directions";
  static constexpr const char* kSource = "";

  int number = 1024, seed = 1;

  void parameters(ParameterVisitor& visit) override {
    visit.integer("count", number, 1, 100'000'000, "rays");
    visit.integer("seed", seed, 0, 2'147'483'647, "of the starts and directions");
  }
  std::size_t count() const override { return static_cast<std::size_t>(number); }
  RaySet rays(const Box& bounds) const override {
    RaySet set;
    for (int i = 0; i < number; ++i) {
      Rng rng(SampleAddress{static_cast<std::uint64_t>(seed), 1, static_cast<std::uint64_t>(i)});
      const Vec3 at = bounds.lo + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(bounds.extent());
      set.rays.push_back({at, random_direction(rng), 0, kInfinity});
    }
    return set;
  }
};

template <class Source>
void add() {
  Registry<RaySetEntry>::instance().add(registry_entry<RaySetEntry, RaySetSource, Source>());
}

[[maybe_unused]] const bool kRegistered = [] {
  add<SingleRay>();
  add<Orthographic>();
  add<Perspective>();
  add<Chords>();
  add<Inside>();
  return true;
}();

}  // namespace
}  // namespace nullmark
