#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <variant>

#include "media/base/registry.h"
#include "media/fractal_noise.h"

namespace nullmark {
namespace {

using Setting = std::variant<Real, int, std::string, std::vector<Real>, Vec3>;
using Settings = std::map<std::string, Setting>;

/// Writes settings into a source's parameters by name, as the configuration reader does.
class Setter final : public ParameterVisitor {
 public:
  explicit Setter(Settings settings) : settings_(std::move(settings)) {}
  void number(const char* name, Real& value, Range range, const char*, const char*) override {
    set(name, value);
    EXPECT_TRUE(range.contains(value)) << name << " = " << value;
  }
  void integer(const char* name, int& value, int low, int high, const char*) override {
    set(name, value);
    EXPECT_TRUE(low <= value && value <= high) << name << " = " << value;
  }
  void flag(const char*, bool&, const char*) override { ADD_FAILURE() << "no medium here has flags"; }
  void choice(const char* name, std::string& value, std::initializer_list<const char*> allowed, const char*) override {
    set(name, value);
    EXPECT_TRUE(std::any_of(allowed.begin(), allowed.end(), [&](const char* a) { return value == a; })) << name;
  }
  void text(const char*, std::string&, const char*) override { ADD_FAILURE() << "no medium here has texts"; }
  void numbers(const char* name, std::vector<Real>& value, int, int, Range range, const char*, const char*) override {
    set(name, value);
    for (const Real x : value) EXPECT_TRUE(range.contains(x)) << name;
  }
  void point(const char* name, Vec3& value, const char*, const char*) override { set(name, value); }

  /// Names that no parameter has asked for.
  const Settings& left() const { return settings_; }

 private:
  template <class T>
  void set(const char* name, T& value) {
    const auto at = settings_.find(name);
    if (at == settings_.end()) return;
    value = std::get<T>(at->second);
    settings_.erase(at);
  }
  Settings settings_;
};

std::shared_ptr<const Medium> make(const std::string& type, const Settings& settings = {}) {
  const MediumEntry* entry = Registry<MediumEntry>::instance().find(type);
  if (entry == nullptr) throw std::runtime_error("not registered: " + type);
  const auto source = entry->make();
  Setter setter(settings);
  source->parameters(setter);
  EXPECT_TRUE(setter.left().empty()) << type << " has no parameter " << setter.left().begin()->first;
  return source->build();
}

struct Case {
  std::string name;
  std::string type;
  Settings settings;
  /// mu at fractions s of the box, written down a second time in long double; may be empty.
  std::function<long double(const std::array<long double, 3>&)> formula;
  bool exact = true;   ///< extrema are attained in the box (up to rounding)
  bool jumps = false;  ///< extinction has steps
  bool closed = true;  ///< optical_depth exists
  Real average_error = 1e-12;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

const Vec3 kLo(-1.5, 2, 0.25), kHi(0.75, 2.5, 4);

long double normal(long double s, long double sigma = .05L) { return std::exp(-(s - .32L) * (s - .32L) / (2 * sigma * sigma)); }

std::vector<Case> cases() {
  using P = std::array<long double, 3>;
  using Numbers = std::vector<Real>;
  const auto in_box = [](Settings s) {
    s["lo"] = kLo;
    s["hi"] = kHi;
    return s;
  };
  std::vector<Case> all;
  const auto add = [&](std::string name, std::string type, Settings s, std::function<long double(const P&)> f) -> Case& {
    all.push_back({std::move(name), std::move(type), std::move(s), std::move(f)});
    return all.back();
  };
  add("homogeneous", "homogeneous", in_box({{"extinction", 2.5}}), [](const P&) { return 2.5L; });
  add("vacuum", "homogeneous", {{"extinction", 0.}}, [](const P&) { return 0.L; });
  add("linear", "linear", in_box({{"begin", 3.}, {"end", 0.5}, {"axis", "z"}}), [](const P& s) { return 3 - 2.5L * s[2]; });
  add("parabola", "polynomial", {}, [](const P& s) { return s[0] * s[0]; });
  add("cubic", "polynomial", in_box({{"coefficients", Numbers{0.5, -3, 9, -6}}, {"axis", "y"}}),
      [](const P& s) { return .5L + s[1] * (-3 + s[1] * (9 - 6 * s[1])); });
  add("touching_quadratic", "polynomial", {{"coefficients", Numbers{1. / 9, -2. / 3, 1}}}, [](const P& s) {
    return std::max(0.L, static_cast<long double>(1. / 9) + s[0] * (static_cast<long double>(-2. / 3) + s[0]));
  });
  add("constant_polynomial", "polynomial", {{"coefficients", Numbers{0.75}}}, [](const P&) { return .75L; });
  add("exponential", "exponential", in_box({{"axis", "y"}}), [](const P& s) { return 3 * std::exp(-3 * s[1]); });
  add("steep_exponential", "exponential", {{"amplitude", 1e-3}, {"rate", 12.}},
      [](const P& s) { return static_cast<long double>(1e-3) * std::exp(12 * s[0]); });
  add("flat_exponential", "exponential", {{"rate", 1e-14}}, [](const P& s) { return 3 * std::exp(1e-14L * s[0]); });
  add("rate_0", "exponential", {{"rate", 0.}}, [](const P&) { return 3.L; });
  add("cube", "exponential_cube", {}, [](const P& s) { return -std::log(s[0]); });
  add("cube_part", "exponential_cube", in_box({{"x0", 0.25}, {"x1", 0.875}, {"axis", "z"}}),
      [](const P& s) { return -std::log(.25L + .625L * s[2]); });
  add("cube_reversed", "exponential_cube", {{"x0", 0.75}, {"x1", 0.125}},
      [](const P& s) { return -std::log(.75L - .625L * s[0]); });
  add("cube_constant", "exponential_cube", {{"x0", 0.5}, {"x1", 0.5}}, [](const P&) { return std::log(2.L); });
  const auto wave = [](long double s) { return 1 + std::cos(20 * s + static_cast<long double>(.8)); };
  add("cosine", "cosine", {}, [wave](const P& s) { return wave(s[0]); });
  add("cosine_box", "cosine", in_box({{"axis", "z"}}), [wave](const P& s) { return wave(s[2]); });
  add("cosine_slow", "cosine", {{"frequency", 0.5}, {"phase", 3.}}, [](const P& s) { return 1 + std::cos(.5L * s[0] + 3); });
  add("bump", "gaussian_bump", {}, [](const P& s) { return normal(s[0]); });
  add("bump_box", "gaussian_bump", in_box({{"axis", "y"}, {"amplitude", 40.}}), [](const P& s) { return 40 * normal(s[1]); });
  add("bump_wide", "gaussian_bump", {{"sigma", 2.5}}, [](const P& s) { return normal(s[0], 2.5L); });
  add("hole", "gaussian_hole", {}, [](const P& s) { return 1 - static_cast<long double>(.95) * normal(s[0]); });
  add("hole_to_zero", "gaussian_hole", in_box({{"depth", 1.}, {"axis", "z"}}), [](const P& s) { return 1 - normal(s[2]); });
  add("layers", "layers", {}, [](const P& s) {
    return s[0] < .25L ? .5L : s[0] < .5L ? 2.L : s[0] < .75L ? 0.L : 1.L;
  }).jumps = true;
  add("layers_uneven", "layers", in_box({{"values", Numbers{1, 5, 0}}, {"edges", Numbers{0.125, 0.875}}, {"axis", "z"}}),
      [](const P& s) { return s[2] < .125L   ? 1.L
                              : s[2] < .875L ? 5.L
                                             : 0.L; })
      .jumps = true;
  add("one_layer", "layers", {{"values", Numbers{1.25}}}, [](const P&) { return 1.25L; });
  for (const Settings& s : {Settings{}, in_box({{"cells_x", 3}, {"cells_y", 1}, {"cells_z", 7}})}) {
    const long double n[] = {s.empty() ? 8.L : 3.L, s.empty() ? 8.L : 1.L, s.empty() ? 8.L : 7.L};
    Case& c = add(s.empty() ? "checkerboard" : "checkerboard_uneven", "checkerboard", s, [=](const P& u) {
      return std::fmod(std::floor(u[0] * n[0]) + std::floor(u[1] * n[1]) + std::floor(u[2] * n[2]), 2.L) == 0 ? 2.L : 0.L;
    });
    c.jumps = true;
    c.closed = false;
    c.average_error = 2e-2;  // its oracle is sampled
  }
  for (const Settings& s :
       {Settings{}, in_box({{"frequency", 3}, {"octaves", 2}, {"sharpness", 1}, {"gain", 0.7}, {"seed", 7}})}) {
    Case& c = add(s.empty() ? "noise" : "noise_box", "fractal_noise", s, nullptr);
    c.exact = c.closed = false;
    c.average_error = 5e-2;
  }
  Case& one = add("noise_one_octave", "fractal_noise", {{"frequency", 5}, {"octaves", 1}, {"sharpness", 3}}, nullptr);
  one.closed = false;
  one.average_error = 5e-2;
  return all;
}

class MediaTest : public testing::TestWithParam<Case> {
 protected:
  const std::shared_ptr<const Medium> medium_ = make(GetParam().type, GetParam().settings);
  const Box whole_ = medium_->bounds();
  std::mt19937_64 random_{17};

  Real uniform(Real a = 0, Real b = 1) { return std::uniform_real_distribution<Real>(a, b)(random_); }

  Vec3 point(const Box& box) {
    return (box.lo + Vec3(uniform(), uniform(), uniform()).cwiseProduct(box.extent())).cwiseMax(box.lo).cwiseMin(box.hi);
  }

  Real look_up(const Vec3& p) const {
    Real value = -1;
    medium_->extinction({&p[0], &p[1], &p[2], 1}, &value);
    return value;
  }

  /// Sides from a whole axis down to 1e-9 of it, some of them zero, some on the faces.
  Box box() {
    Box b;
    for (int axis = 0; axis < 3; ++axis) {
      const Real size = whole_.extent()[axis], side = uniform() < 0.1 ? 0 : size * std::pow(10., -9 * std::pow(uniform(), 2));
      const Real at = uniform() < 0.1 ? 0 : uniform() < 0.1 ? size - side : uniform() * (size - side);
      b.lo[axis] = std::clamp(whole_.lo[axis] + at, whole_.lo[axis], whole_.hi[axis]);
      b.hi[axis] = std::clamp(b.lo[axis] + side, b.lo[axis], whole_.hi[axis]);
    }
    return b;
  }

  /// Rays through the box in all directions: generic, axis-parallel with +0 and -0, nearly so, either way along it.
  Ray ray() {
    static constexpr Real kSmall[] = {0., -0., 1e-9, -1e-9, 1e-5, -1e-5};
    Ray r;
    r.origin = point(whole_);
    std::normal_distribution<Real> normal;
    r.direction = Vec3(normal(random_), normal(random_), normal(random_)).normalized();
    const int kind = std::uniform_int_distribution<int>(0, 9)(random_);
    for (int axis = 0; axis < 3; ++axis)
      if (kind < 3 ? axis != kind : kind < 6 && axis == kind - 3)
        r.direction[axis] = kSmall[std::uniform_int_distribution<int>(0, 5)(random_)];
    r.direction.normalize();
    // Backed off, so that the interval does not start at 0.
    r.origin -= uniform(0, 2) * r.direction;
    r.begin = 0;
    r = clipped(r, whole_);
    if (uniform() < 0.5) {
      const Real a = uniform(r.begin, r.end), b = uniform(r.begin, r.end);
      r.begin = std::min(a, b);
      r.end = std::max(a, b);
    }
    return r;
  }

  std::vector<Real> pieces(const Ray& r) const {
    std::vector<Real> t;
    medium_->knots(r, t);
    for (const Real at : t) EXPECT_TRUE(at > r.begin && at < r.end);
    t.push_back(r.begin);
    t.push_back(r.end);
    std::sort(t.begin(), t.end());
    return t;
  }

  template <class Rule>
  Real integrate(const Ray& r, const Rule& rule) const {
    const std::vector<Real> t = pieces(r);
    Real sum = 0;
    for (std::size_t i = 1; i < t.size(); ++i)
      if (t[i] > t[i - 1]) sum += rule([&](Real at) { return look_up(r.at(at)); }, t[i - 1], t[i]);
    return sum;
  }

  /// Adaptive Gauss-Kronrod between knots.
  Real oracle(const Ray& r) const {
    return integrate(r, [](const auto& f, Real a, Real b) {
      return boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(f, a, b, 6, 1e-12);
    });
  }

  /// What an error of rounding in the ray's points can do to the optical depth: 1e-14 relative plus the change under shifts of a
  /// few ulps, told from larger shifts where mu is smooth.
  Real tolerance(const Ray& r, Real depth) const {
    constexpr Real kShift = 1e-9, kUlps = 8 * std::numeric_limits<Real>::epsilon();
    Real change = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (const Real side : {-1., 1.}) {
        Ray moved = r;
        moved.origin[axis] += side * kShift;
        const Real size = std::max(std::abs(r.at(r.begin)[axis]), std::abs(r.origin[axis])) + whole_.extent()[axis];
        const Real shifted = integrate(
            moved, [](const auto& f, Real a, Real b) { return boost::math::quadrature::gauss<Real, 30>::integrate(f, a, b); });
        change = std::max(change, std::abs(shifted - depth) / kShift * kUlps * size);
      }
    return 1e-14 * depth + change + 1e-300;
  }
};

TEST_P(MediaTest, ExtinctionIsFiniteAndNotNegative) {
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = point(i % 2 == 0 ? whole_ : box());
    const Real value = look_up(p);
    ASSERT_TRUE(std::isfinite(value) && value >= 0) << value << " at " << p.transpose();
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1 ? whole_.hi : whole_.lo)[0], (corner & 2 ? whole_.hi : whole_.lo)[1],
                 (corner & 4 ? whole_.hi : whole_.lo)[2]);
    EXPECT_TRUE(std::isfinite(look_up(p)) && look_up(p) >= 0);
    // Points are inside up to rounding only.
    const Vec3 beyond = p + 1e-15 * (p - (whole_.lo + whole_.hi) / 2);
    EXPECT_TRUE(std::isfinite(look_up(beyond)) && look_up(beyond) >= 0);
  }
}

TEST_P(MediaTest, ExtinctionFollowsItsFormula) {
  if (!GetParam().formula) return;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = point(whole_);
    std::array<long double, 3> s;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      s[a] =
          (static_cast<long double>(p[axis]) - whole_.lo[axis]) / (static_cast<long double>(whole_.hi[axis]) - whole_.lo[axis]);
    }
    const auto expected = static_cast<Real>(GetParam().formula(s));
    ASSERT_NEAR(look_up(p), expected, 1e-13 * std::abs(expected) + 1e-14) << p.transpose();
  }
}

TEST_P(MediaTest, BlockEqualsSingleLookups) {
  std::vector<Real> x, y, z, out(100, -1);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3 p = point(whole_);
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
  medium_->extinction({x.data(), y.data(), z.data(), out.size()}, out.data());
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i], look_up({x[i], y[i], z[i]}));
}

TEST_P(MediaTest, ExtremaBoundEveryPoint) {
  for (int i = 0; i < 3000; ++i) {
    const Box b = box();
    const Extrema e = medium_->extrema(b);
    ASSERT_LE(0, e.minimum[0]);
    ASSERT_LE(e.minimum[0], e.average[0]);
    ASSERT_LE(e.average[0], e.maximum[0]);
    for (int k = 0; k < 40; ++k) {
      Vec3 p = point(b);
      // Corners and faces too; where mu jumps, a face that lies in the jump's plane belongs to the next cell.
      if (k < 8 && !GetParam().jumps)
        for (int axis = 0; axis < 3; ++axis) p[axis] = (k >> axis & 1 ? b.hi : b.lo)[axis];
      const Real value = look_up(p);
      ASSERT_TRUE(e.minimum[0] <= value && value <= e.maximum[0])
          << value << " outside [" << e.minimum[0] << ", " << e.maximum[0] << "] at " << p.transpose() << " in box "
          << b.lo.transpose() << " .. " << b.hi.transpose();
    }
  }
}

// Dense sampling comes near both bounds where they are exact; smaller boxes have closer bounds wherever mu is continuous.
TEST_P(MediaTest, ExtremaAreTight) {
  for (int i = 0; i < (GetParam().exact ? 40 : 0); ++i) {
    Box b = box();
    const Extrema e = medium_->extrema(b);
    if (!std::isfinite(e.maximum[0])) continue;
    Real low = kInfinity, high = 0;
    constexpr int kSteps = 24, kFine = 4000;
    const auto see = [&](const Vec3& p) {
      low = std::min(low, look_up(p));
      high = std::max(high, look_up(p));
    };
    const bool solid = GetParam().type == "checkerboard" || GetParam().type == "fractal_noise";
    for (int k = 0; k <= (solid ? 0 : kFine); ++k) see(b.lo + b.extent() * k / kFine);
    // Cells a box barely covers are easily missed.
    if (solid && (GetParam().jumps || e.maximum[0] == 0)) {
      if (e.minimum[0] == e.maximum[0]) continue;
      for (int k = 0; k < 100000 && low == high; ++k) see(point(b));
      if (low == high) continue;
    } else if (solid) {
      for (int x = 0; x <= kSteps; ++x)
        for (int y = 0; y <= kSteps; ++y)
          for (int z = 0; z <= kSteps; ++z) see(b.lo + b.extent().cwiseProduct(Vec3(x, y, z)) / kSteps);
    }
    const Real resolution = solid ? 0.05 : 1e-3;
    ASSERT_NEAR(e.minimum[0], low, resolution * (e.maximum[0] - e.minimum[0]) + 1e-13 * (1 + high));
    ASSERT_NEAR(e.maximum[0], high, resolution * (e.maximum[0] - e.minimum[0]) + 1e-13 * (1 + high));
  }
  if (GetParam().jumps) return;
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = point({whole_.lo + 0.01 * whole_.extent(), whole_.hi - 0.01 * whole_.extent()});
    const Vec3 side = 1e-8 * whole_.extent();
    const Extrema e = medium_->extrema({p - side, p + side});
    ASSERT_LE(e.maximum[0] - e.minimum[0], 1e-4 * (1 + medium_->extrema({p, p}).maximum[0]));
  }
}

TEST_P(MediaTest, AverageIsTheMean) {
  for (int i = 0; i < 5; ++i) {
    Box b = i == 0 ? whole_ : box();
    const Extrema e = medium_->extrema(b);
    Real mean = 0;
    if (GetParam().average_error < 1e-6) {
      Ray diagonal;  // all these media vary along one axis
      diagonal.origin = b.lo;
      diagonal.direction = b.extent();
      diagonal.begin = 0;
      diagonal.end = 1;
      mean = oracle(diagonal);
      ASSERT_NEAR(e.average[0], mean, 1e-12 * mean + tolerance(diagonal, mean));
      continue;
    }
    constexpr int kPoints = 40000;
    for (int k = 0; k < kPoints; ++k) mean += look_up(point(b)) / kPoints;
    ASSERT_NEAR(e.average[0], mean, GetParam().average_error * std::max(mean, 0.5 * e.maximum[0]));
  }
}

TEST_P(MediaTest, BoxesOutsideAreVacuum) {
  const Vec3 far = whole_.hi + Vec3::Ones();
  const Extrema e = medium_->extrema({far, far + Vec3::Ones()});
  EXPECT_EQ(e.maximum[0], 0);
  const Extrema cut = medium_->extrema({whole_.lo - Vec3::Ones(), whole_.hi + Vec3::Ones()}), all = medium_->extrema(whole_);
  EXPECT_EQ(cut.minimum[0], all.minimum[0]);
  EXPECT_EQ(cut.maximum[0], all.maximum[0]);
}

TEST_P(MediaTest, OpticalDepthEqualsQuadrature) {
  for (int i = 0; i < 1000; ++i) {
    const Ray r = ray();
    const auto found = medium_->optical_depth(r);
    ASSERT_EQ(found.has_value(), GetParam().closed);
    if (!found) return;
    ASSERT_EQ(found->size(), 1);
    const Real expected = oracle(r);
    ASSERT_NEAR((*found)[0], expected, tolerance(r, expected))
        << "direction " << r.direction.transpose() << " from " << r.at(r.begin).transpose() << " length " << r.length();
    // The same stretch walked backwards, and uncut: both see the same vacuum outside.
    Ray back = {r.origin, -r.direction, -r.end, -r.begin};
    ASSERT_NEAR((*medium_->optical_depth(back))[0], (*found)[0], 2 * tolerance(r, expected));
    Ray beyond = clipped({r.origin, r.direction, -100, 100}, whole_), endless = {r.origin, r.direction, -100, 100};
    ASSERT_EQ((*medium_->optical_depth(beyond))[0], (*medium_->optical_depth(endless))[0]);
  }
}

TEST_P(MediaTest, EmptyIntervalsHaveNoDepth) {
  Ray r;
  r.origin = point(whole_);
  r.begin = r.end = 0;
  EXPECT_EQ(medium_->optical_depth(r).value_or(Spectrum::Zero(1))[0], 0);
  r.origin = whole_.hi + Vec3::Ones();
  r.end = kInfinity;
  EXPECT_EQ(medium_->optical_depth(r).value_or(Spectrum::Zero(1))[0], 0);
}

TEST_P(MediaTest, FifteenPointsResolveBetweenKnots) {
  for (int i = 0; i < 100; ++i) {
    const Ray r = ray();
    const Real coarse =
        integrate(r, [](const auto& f, Real a, Real b) { return boost::math::quadrature::gauss<Real, 15>::integrate(f, a, b); });
    const Real fine = integrate(r, [](const auto& f, Real a, Real b) {
      Real sum = 0;
      for (int k = 0; k < 4; ++k)
        sum += boost::math::quadrature::gauss<Real, 30>::integrate(f, a + (b - a) * k / 4, a + (b - a) * (k + 1) / 4);
      return sum;
    });
    ASSERT_NEAR(coarse, fine, 1e-11 * fine + tolerance(r, fine));
  }
}

TEST_P(MediaTest, PolynomialDegreeIntegratesExactly) {
  const auto degree = medium_->polynomial_degree();
  if (!degree) return;
  const int n = *degree / 2 + 1;
  std::vector<std::pair<Real, Real>> rule;
  for (const Real x : boost::math::legendre_p_zeros<Real>(n)) {
    const Real slope = boost::math::legendre_p_prime(n, x), weight = 2 / ((1 - x * x) * slope * slope);
    rule.emplace_back(x, weight);
    if (x != 0) rule.emplace_back(-x, weight);
  }
  for (int i = 0; i < 100; ++i) {
    const Ray r = ray();
    const Real found = integrate(r, [&](const auto& f, Real a, Real b) {
      Real sum = 0;
      for (const auto& [x, weight] : rule) sum += weight * f((a + b) / 2 + x * (b - a) / 2);
      return sum * (b - a) / 2;
    });
    const Real expected = oracle(r);
    ASSERT_NEAR(found, expected, 1e-13 * expected + tolerance(r, expected));
  }
}

INSTANTIATE_TEST_SUITE_P(All, MediaTest, testing::ValuesIn(cases()), [](const auto& instance) { return instance.param.name; });

std::string error_of(const std::string& type, const Settings& settings) {
  try {
    make(type, settings);
  } catch (const ParameterError& error) {
    return error.parameter + ": " + error.what();
  }
  return "";
}

TEST(MediaRegistry, HoldsTheProceduralMedia) {
  for (const char* name : {"checkerboard", "cosine", "exponential", "exponential_cube", "fractal_noise", "gaussian_bump",
                           "gaussian_hole", "homogeneous", "layers", "linear", "polynomial"}) {
    const MediumEntry* entry = Registry<MediumEntry>::instance().find(name);
    ASSERT_NE(entry, nullptr) << name;
    EXPECT_FALSE(entry->summary.empty());
    EXPECT_FALSE(entry->source.empty());
    EXPECT_EQ(make(name)->channels(), 1);
  }
}

TEST(MediaParameters, AxisHasTheAskedOpticalDepth) {
  for (const char* type :
       {"linear", "polynomial", "exponential", "exponential_cube", "cosine", "gaussian_bump", "gaussian_hole", "layers"})
    for (const char* axis : {"x", "y", "z"})
      for (const Real tau : {1e-4, 1., 1000.}) {
        const auto medium = make(type, {{"axis", axis}, {"optical_depth", tau}, {"lo", kLo}, {"hi", kHi}});
        Ray r;
        r.origin = (kLo + kHi) / 2;
        r.direction = Vec3::Unit(axis[0] - 'x');
        r.begin = -100;
        r.end = 100;
        EXPECT_NEAR((*medium->optical_depth(r))[0], tau, 1e-14 * tau) << type << axis;
      }
}

TEST(MediaParameters, ContradictionsAreNamed) {
  using Numbers = std::vector<Real>;
  const std::string dip = error_of("polynomial", {{"coefficients", Numbers{0.2, -1, 1}}});
  EXPECT_NE(dip.find("coefficients: "), std::string::npos);
  EXPECT_NE(dip.find("-0.05 at s = 0.5"), std::string::npos) << dip;
  const std::string cubic = error_of("polynomial", {{"coefficients", Numbers{0, 1, -3, 2}}});  // s (1-s) (1-2s)
  EXPECT_NE(cubic.find("at s = 0.788675"), std::string::npos) << cubic;
  EXPECT_EQ(error_of("polynomial", {{"coefficients", Numbers{0.25, -1, 1}}}), "");
  EXPECT_NE(error_of("gaussian_hole", {{"depth", 1.5}}).find("depth: "), std::string::npos);
  EXPECT_NE(error_of("exponential_cube", {{"x0", 1.}}).find("x0: "), std::string::npos);
  EXPECT_NE(error_of("exponential_cube", {{"x1", 0.}}).find("x1: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0.5}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0.5, 0.5, 0.75}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0., 0.5, 0.75}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("fractal_noise", {{"frequency", 64}, {"octaves", 9}}).find("octaves: "), std::string::npos);
  for (const MediumEntry& entry : Registry<MediumEntry>::instance().entries()) {
    if (entry.name == "vdb" || entry.name == "canonical") continue;  // their boxes are the file's, and of a length
    EXPECT_NE(error_of(entry.name, {{"hi", Vec3(1, 0, 1)}}).find("hi: "), std::string::npos) << entry.name;
  }
}

TEST(ExponentialCube, PerpendicularRaysHaveThePowerLaw) {
  const auto medium = make("exponential_cube");
  for (const Real x : {1e-12, 0.1, 0.5, 0.999}) {
    const auto depth = medium->optical_depth({{x, 0.3, 0}, {0, 0, 1}, 0, 0.75});
    EXPECT_NEAR(std::exp(-(*depth)[0]), std::pow(x, 0.75), 1e-15);
  }
  EXPECT_EQ(medium->extrema({{0, 0, 0}, {0.5, 1, 1}}).maximum[0], kInfinity);
  EXPECT_TRUE(std::isfinite(medium->extrema({{1e-9, 0, 0}, {0.5, 1, 1}}).maximum[0]));
  EXPECT_NEAR(medium->extrema({{0, 0, 0}, {1, 1, 1}}).average[0], 1, 1e-15);
}

TEST(Cosine, BoundsHaveTheInnerExtrema) {
  const auto medium = make("cosine");
  const Real crest = (2 * std::numbers::pi - 0.8) / 20, trough = (std::numbers::pi - 0.8) / 20;
  EXPECT_EQ(medium->extrema({{crest - 1e-3, 0, 0}, {crest + 2e-3, 1, 1}}).maximum[0], 2);
  EXPECT_EQ(medium->extrema({{trough - 1e-3, 0, 0}, {trough + 2e-3, 1, 1}}).minimum[0], 0);
}

// Far in the tail the difference of error functions keeps its digits: the first terms of the asymptotic series say what it is.
TEST(GaussianBump, TailKeepsRelativeAccuracy) {
  const auto medium = make("gaussian_bump", {{"sigma", 0.02}});
  const Real found = (*medium->optical_depth({{0.8, 0.5, 0.5}, {1, 0, 0}, 0, 0.2}))[0];
  const long double z = (static_cast<long double>(0.8) - static_cast<long double>(0.32)) / static_cast<long double>(0.02),
                    q = 1 / (z * z);
  long double term = 1, series = 0;
  for (int k = 0; k < 20; ++k, term *= -(2 * k - 1) * q) series += term;
  const auto expected = static_cast<Real>(static_cast<long double>(0.02) * std::exp(-z * z / 2) / z * series);
  EXPECT_NEAR(found / expected, 1, 1e-12);
}

// A majorant grid aligned with the cells has tight bounds in every one of them.
TEST(StepMedia, AlignedBoxesHaveTightBounds) {
  for (const int n : {3, 7, 10, 12}) {
    std::vector<Real> values;
    for (int i = 0; i < n; ++i) values.push_back(1 + i % 3);
    const Settings where = {{"lo", kLo}, {"hi", kHi}};
    Settings layers = where, board = where;
    layers["values"] = values;
    board["cells_x"] = board["cells_y"] = board["cells_z"] = n;
    for (const auto& medium : {make("layers", layers), make("checkerboard", board)})
      for (int i = 0; i < n; ++i) {
        const Vec3 step = (kHi - kLo) / n;
        const Vec3 lo = kLo + i * step, hi = kLo + (i + 1) * step;
        const Extrema e = medium->extrema({lo, hi});
        EXPECT_EQ(e.minimum[0], e.maximum[0]) << n << ", " << i;
      }
  }
}

TEST(StepMedia, EdgesBelongToTheCellAbove) {
  const Vec3 p(0.25, 0.1, 0.1);
  Real value = -1;
  make("layers")->extinction({&p[0], &p[1], &p[2], 1}, &value);
  EXPECT_EQ(value, 2);
  make("checkerboard")->extinction({&p[0], &p[1], &p[2], 1}, &value);
  EXPECT_EQ(value, 2);
  const Vec3 top = Vec3::Ones();
  make("checkerboard", {{"cells_x", 3}, {"cells_y", 3}, {"cells_z", 3}})->extinction({&top[0], &top[1], &top[2], 1}, &value);
  EXPECT_EQ(value, 2);
}

TEST(FractalNoise, EqualsThePlainSumOfOctaves) {
  const auto medium = make("fractal_noise", {{"seed", 5}, {"octaves", 3}, {"gain", 0.25}});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p(uniform(random), uniform(random), uniform(random));
    Real n = 0;
    for (int o = 0; o < 3; ++o) {
      const Vec3 q = p * (4 << o), cell = q.array().floor(), t = q - cell;
      const Vec3 w = t.array().square() * (3 - 2 * t.array());
      Real noise = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 c(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const auto index = [&](int axis) { return static_cast<std::uint32_t>(cell[axis] + c[axis]); };
        const Real value = philox4x32({index(0), index(1), index(2), static_cast<std::uint32_t>(o)}, {5, 0})[0] * 0x1p-32;
        noise += value * (c.array() * w.array() + (1 - c.array()) * (1 - w.array())).prod();
      }
      n += noise * std::pow(0.25, o) / 1.3125;
    }
    Real found = 0;
    medium->extinction({&p[0], &p[1], &p[2], 1}, &found);
    ASSERT_NEAR(found, 10 * n * n, 1e-5);  // lattice values keep 24 bits
  }
}

TEST(FractalNoise, SeedsDiffer) {
  std::set<Real> values;
  const Vec3 p(0.3, 0.4, 0.5);
  for (int seed = 0; seed < 20; ++seed) {
    Real value = 0;
    make("fractal_noise", {{"seed", seed}})->extinction({&p[0], &p[1], &p[2], 1}, &value);
    values.insert(value);
  }
  EXPECT_EQ(values.size(), 20u);
}

}  // namespace
}  // namespace nullmark
