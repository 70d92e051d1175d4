#pragma once

#include <array>
#include <boost/container/small_vector.hpp>

#include "media/base/field.h"
#include "media/base/lanes.h"
#include "media/base/philox.h"

namespace nullmark {

/// A cloud: mu(p) = peak n(p)^sharpness, 1/length, with n the sum of value-noise octaves of frequency, 2 frequency, 4 frequency,
/// ... cells across the box, weighted 1, gain, gain^2, ... and divided by the sum of the weights (Perlin 1985 and Ebert et al.
/// 2003 for sums of octaves).  Lattice values are Philox words of (i, j, k, octave) under the key `seed`, in [0,1); between them
/// a trilinear blend with smoothstep weights 3t^2 - 2t^3.  No threshold, so no kink; mu has continuous first derivatives.
///
/// A blend is a convex combination: 0 <= mu < peak is a true bound, and within one lattice cell an octave is affine in each of
/// the three weights, so its extrema over a box are among the corners of the box's pieces.  Along a ray n is a polynomial of
/// degree 9 in each finest cell (three cubics multiplied), hence mu one of 9 sharpness.
struct FractalNoise {
  static constexpr const char* kName = "fractal_noise";
  static constexpr const char* kSummary = "seeded cloud of value-noise octaves with a true bound";
  static constexpr const char* kSource = "Perlin 1985; Ebert et al. 2003, fractal sums";

  /// Tables of all octaves together: 128 MiB.
  static constexpr std::size_t kMostLatticeValues = std::size_t{1} << 25;

  Real peak = 10;
  int frequency = 4, octaves = 4;
  Real gain = 0.5;
  int sharpness = 2, seed = 1;
  Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();

  void parameters(ParameterVisitor& visit) {
    visit.number("peak", peak, Range::non_negative(), "1/length", "upper bound on the extinction, never reached");
    visit.integer("frequency", frequency, 1, 256, "cells of the coarsest octave across each side of the box");
    visit.integer("octaves", octaves, 1, 9, "octaves, each with twice the frequency of the one before");
    visit.number("gain", gain, Range::between(0, 1), "", "weight of an octave relative to the one before");
    visit.integer("sharpness", sharpness, 1, 8, "power of the noise: higher is sparser");
    visit.integer("seed", seed, 0, std::numeric_limits<int>::max(), "which cloud");
    visit.point("lo", lo, "length", "lower corner of the box");
    visit.point("hi", hi, "length", "upper corner of the box");
  }

  void prepare() {
    if (Box{lo, hi}.empty()) throw ParameterError("hi", "box is empty: every component of hi must exceed that of lo");
    inverse_extent_ = (hi - lo).cwiseInverse();
    std::size_t size = 0;
    Real sum = 0, weight = 1;
    octaves_.clear();
    for (int o = 0; o < octaves; ++o, weight *= gain) {
      const int n = frequency << o;
      octaves_.push_back({n, size, weight});
      const auto nodes = static_cast<std::size_t>(n) + 1;
      size += nodes * nodes * nodes;
      sum += weight;
    }
    if (size > kMostLatticeValues)
      throw ParameterError("octaves", "the lattices would hold " + std::to_string(size) + " values, at most " +
                                          std::to_string(kMostLatticeValues) + " are allowed: lower octaves or frequency");
    lattice_.resize(size);
    auto at = lattice_.begin();
    for (int o = 0; o < octaves; ++o) {
      Octave& octave = octaves_[static_cast<std::size_t>(o)];
      octave.weight /= sum;
      const auto nodes = static_cast<std::uint32_t>(octave.cells + 1);
      for (std::uint32_t k = 0; k < nodes; ++k)
        for (std::uint32_t j = 0; j < nodes; ++j)
          for (std::uint32_t i = 0; i < nodes; ++i) *at++ = lattice_value(i, j, k, static_cast<std::uint32_t>(o));
    }
  }

  Box bounds() const { return {lo, hi}; }

  Real extinction(const Vec3& p) const {
    const Vec3 u = unit(p);
    Real n = 0;
    for (const Octave& octave : octaves_) n += octave.weight * noise(octave, u);
    return sharpened(n);
  }

  /// The same bit for bit, a register of points at a time.
  void extinction(const Points& points, Real* out) const {
    using Pack = Lanes<Real, kNativeLanes<Real>>;
    constexpr std::size_t kWidth = kNativeLanes<Real>;
    std::size_t i = 0;
    for (; i + kWidth <= points.size; i += kWidth) {
      const Pack x = unit(Pack::load(points.x + i), 0), y = unit(Pack::load(points.y + i), 1),
                 z = unit(Pack::load(points.z + i), 2);
      Pack n = 0;
      for (const Octave& octave : octaves_) n += octave.weight * noise(octave, x, y, z);
      sharpened(n).store(out + i);
    }
    for (; i < points.size; ++i) out[i] = extinction(points[i]);
  }

  Extrema extrema(const Box& box) const {
    const Vec3 a = unit(box.lo), b = unit(box.hi);
    Real low = 0, high = 0;
    for (const Octave& octave : octaves_) {
      const auto [minimum, maximum] = octave_extrema(octave, a, b);
      low += octave.weight * minimum;
      high += octave.weight * maximum;
    }
    // Weights and blends are monotone to rounding only; all numbers here are below 1.
    constexpr Real kRounding = 32 * std::numeric_limits<Real>::epsilon();
    const Real minimum = sharpened(std::max<Real>(0, low - kRounding)), maximum = sharpened(std::min<Real>(1, high + kRounding));
    return Extrema::grey(minimum, std::clamp(average(box, b - a), minimum, maximum), maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const {
    for (int axis = 0; axis < 3; ++axis) append_planes(ray, axis, lo[axis], hi[axis], octaves_.back().cells, t);
  }

  int polynomial_degree() const { return 9 * sharpness; }

 private:
  struct Octave {
    int cells;           ///< across each side
    std::size_t offset;  ///< of its lattice in the table
    Real weight;
  };

  /// A coordinate's lattice cell and smoothstep weight.
  struct Place {
    int cell;
    Real weight;
  };

  float lattice_value(std::uint32_t i, std::uint32_t j, std::uint32_t k, std::uint32_t octave) const {
    const std::uint32_t word = philox4x32({i, j, k, octave}, {static_cast<std::uint32_t>(seed), 0})[0];
    return static_cast<float>(word >> 8) * 0x1p-24f;
  }

  Vec3 unit(const Vec3& p) const { return (p - lo).cwiseProduct(inverse_extent_).cwiseMax(Real{0}).cwiseMin(Real{1}); }

  template <std::size_t N>
  Lanes<Real, N> unit(Lanes<Real, N> p, int axis) const {
    return smaller(Lanes<Real, N>(1), larger(Lanes<Real, N>(0), (p - lo[axis]) * inverse_extent_[axis]));
  }

  static Place place(Real u, int cells) {
    const Real x = u * cells;
    const int cell = std::min(static_cast<int>(x), cells - 1);
    const Real t = x - cell;
    return {cell, std::min<Real>(1, t * t * (3 - 2 * t))};
  }

  Real noise(const Octave& octave, const Vec3& u) const {
    return blend(octave, place(u[0], octave.cells), place(u[1], octave.cells), place(u[2], octave.cells));
  }

  Real blend(const Octave& octave, Place x, Place y, Place z) const {
    const auto row = static_cast<std::size_t>(octave.cells) + 1;
    const float* v = lattice_.data() + octave.offset +
                     (static_cast<std::size_t>(z.cell) * row + static_cast<std::size_t>(y.cell)) * row +
                     static_cast<std::size_t>(x.cell);
    const auto mix = [](Real a, Real b, Real w) { return a + w * (b - a); };
    const auto edge = [&](const float* at) { return mix(at[0], at[1], x.weight); };
    const auto face = [&](const float* at) { return mix(edge(at), edge(at + row), y.weight); };
    return mix(face(v), face(v + row * row), z.weight);
  }

  /// The same for a register of points; nodes are counted in double, which is exact below 2^25 of them.
  template <std::size_t N>
  Lanes<Real, N> noise(const Octave& octave, Lanes<Real, N> x, Lanes<Real, N> y, Lanes<Real, N> z) const {
    using Pack = Lanes<Real, N>;
    const Real cells = octave.cells, row = cells + 1;
    const auto cell = [&](Pack& u) {
      const Pack at = u * cells, lowest = smaller(rounded_down(at), Pack(cells - 1)), t = at - lowest;
      u = smaller(Pack(1), t * t * (3 - 2 * t));
      return lowest;
    };
    const Pack i = cell(x), j = cell(y), k = cell(z);
    const auto corner = hn::DemoteTo(hn::FixedTag<std::int32_t, N>(), ((k * row + j) * row + i).vector());
    const float* const lattice = lattice_.data() + octave.offset;
    const auto value = [&](int step) -> Pack {
      return hn::PromoteTo(hn::FixedTag<Real, N>(), hn::GatherIndex(hn::FixedTag<float, N>(), lattice + step, corner));
    };
    const auto mix = [](Pack a, Pack b, Pack w) { return a + w * (b - a); };
    const auto edge = [&](int step) { return mix(value(step), value(step + 1), x); };
    const auto face = [&](int step) { return mix(edge(step), edge(step + octave.cells + 1), y); };
    return mix(face(0), face((octave.cells + 1) * (octave.cells + 1)), z);
  }

  template <class Number>
  Number sharpened(Number n) const {
    Number power = n;
    for (int i = 1; i < sharpness; ++i) power *= n;
    return peak * power;
  }

  /// Ends of [a, b] and the lattice planes between them.  Sums of media ask for bounds along every leg of a path, so the usual
  /// number is not allocated.
  static boost::container::small_vector<Place, 64> places(Real a, Real b, int cells) {
    const Place first = place(a, cells), last = place(b, cells);
    boost::container::small_vector<Place, 64> all = {first};
    for (int plane = first.cell + 1; plane <= last.cell; ++plane) all.push_back({plane, 0});
    all.push_back(last);
    return all;
  }

  std::pair<Real, Real> octave_extrema(const Octave& octave, const Vec3& a, const Vec3& b) const {
    const auto xs = places(a[0], b[0], octave.cells), ys = places(a[1], b[1], octave.cells),
               zs = places(a[2], b[2], octave.cells);
    Real minimum = 1, maximum = 0;
    for (const Place z : zs)
      for (const Place y : ys)
        for (const Place x : xs) {
          const Real value = blend(octave, x, y, z);
          minimum = std::min(minimum, value);
          maximum = std::max(maximum, value);
        }
    return {minimum, maximum};
  }

  /// Midpoint rule with two points per finest cell, at most 8 a side: a control needs no more.
  Real average(const Box& box, const Vec3& extent) const {
    std::array<int, 3> n = {};
    for (int axis = 0; axis < 3; ++axis)
      n[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::clamp<Real>(std::ceil(2 * extent[axis] * octaves_.back().cells), 2, 8));
    Real sum = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          sum += extinction(box.lo + Vec3((i + 0.5) / n[0], (j + 0.5) / n[1], (k + 0.5) / n[2]).cwiseProduct(box.extent()));
    return sum / (n[0] * n[1] * n[2]);
  }

  Vec3 inverse_extent_ = Vec3::Ones();
  std::vector<Octave> octaves_;
  std::vector<float> lattice_;
};

}  // namespace nullmark
