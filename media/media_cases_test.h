#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "media/media_test.h"

/// Every procedural medium, with what is known of it.
namespace nullmark::media_test {

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

inline std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

inline long double normal(long double s, long double sigma = .05L) {
  return std::exp(-(s - .32L) * (s - .32L) / (2 * sigma * sigma));
}

class Cases {
 public:
  Cases() {
    add_polynomials_and_exponentials();
    add_waves_and_bumps();
    add_steps();
    add_noise();
  }

  const std::vector<Case>& all() const { return all_; }

 private:
  using P = std::array<long double, 3>;
  using Numbers = std::vector<Real>;

  static Settings in_box(Settings s) {
    s["lo"] = kLo;
    s["hi"] = kHi;
    return s;
  }

  Case& add(std::string name, std::string type, Settings s, std::function<long double(const P&)> f) {
    all_.push_back({std::move(name), std::move(type), std::move(s), std::move(f)});
    return all_.back();
  }

  void add_polynomials_and_exponentials() {
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
    add("steepest_exponential", "exponential", {{"rate", -700.}}, [](const P& s) { return 3 * std::exp(-700 * s[0]); });
    add("flat_exponential", "exponential", {{"rate", 1e-14}}, [](const P& s) { return 3 * std::exp(1e-14L * s[0]); });
    add("rate_0", "exponential", {{"rate", 0.}}, [](const P&) { return 3.L; });
    add("cube", "exponential_cube", {}, [](const P& s) { return -std::log(s[0]); });
    add("cube_part", "exponential_cube", in_box({{"x0", 0.25}, {"x1", 0.875}, {"axis", "z"}}),
        [](const P& s) { return -std::log(.25L + .625L * s[2]); });
    add("cube_reversed", "exponential_cube", {{"x0", 0.75}, {"x1", 0.125}},
        [](const P& s) { return -std::log(.75L - .625L * s[0]); });
    add("cube_constant", "exponential_cube", {{"x0", 0.5}, {"x1", 0.5}}, [](const P&) { return std::log(2.L); });
  }

  void add_waves_and_bumps() {
    const auto wave = [](long double s) { return 1 + std::cos(20 * s + static_cast<long double>(.8)); };
    add("cosine", "cosine", {}, [wave](const P& s) { return wave(s[0]); });
    add("cosine_box", "cosine", in_box({{"axis", "z"}}), [wave](const P& s) { return wave(s[2]); });
    add("cosine_slow", "cosine", {{"frequency", 0.5}, {"phase", 3.}}, [](const P& s) { return 1 + std::cos(.5L * s[0] + 3); });
    add("bump", "gaussian_bump", {}, [](const P& s) { return normal(s[0]); });
    add("bump_box", "gaussian_bump", in_box({{"axis", "y"}, {"amplitude", 40.}}), [](const P& s) { return 40 * normal(s[1]); });
    add("bump_wide", "gaussian_bump", {{"sigma", 2.5}}, [](const P& s) { return normal(s[0], 2.5L); });
    add("hole", "gaussian_hole", {}, [](const P& s) { return 1 - static_cast<long double>(.95) * normal(s[0]); });
    add("hole_to_zero", "gaussian_hole", in_box({{"depth", 1.}, {"axis", "z"}}), [](const P& s) { return 1 - normal(s[2]); });
  }

  void add_steps() {
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
  }

  void add_noise() {
    for (const Settings& s :
         {Settings{}, in_box({{"frequency", 3}, {"octaves", 2}, {"sharpness", 1}, {"gain", 0.7}, {"seed", 7}})}) {
      Case& c = add(s.empty() ? "noise" : "noise_box", "fractal_noise", s, nullptr);
      c.exact = c.closed = false;
      c.average_error = 5e-2;
    }
    Case& one = add("noise_one_octave", "fractal_noise", {{"frequency", 5}, {"octaves", 1}, {"sharpness", 3}}, nullptr);
    one.closed = false;
    one.average_error = 5e-2;
  }

  std::vector<Case> all_;
};

inline std::vector<Case> cases() { return Cases().all(); }

}  // namespace nullmark::media_test
