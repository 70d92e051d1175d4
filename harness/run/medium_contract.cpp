#include "harness/run/medium_contract.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <random>

#include "harness/config/component_reader.h"
#include "harness/sampling/scene.h"

namespace nullmark {
namespace {

class MediumContract {
 public:
  explicit MediumContract(const Medium& medium) : medium_(medium), whole_(medium.bounds()) {}

  std::vector<ContractFinding> findings() {
    extinction();
    extrema();
    optical_depth();
    return std::move(findings_);
  }

 private:
  Real uniform(Real a = 0, Real b = 1) { return std::uniform_real_distribution<Real>(a, b)(random_); }

  Vec3 point(const Box& box) {
    return (box.lo + Vec3(uniform(), uniform(), uniform()).cwiseProduct(box.extent())).cwiseMax(box.lo).cwiseMin(box.hi);
  }

  /// Sides from a whole axis down to 1e-9 of it.
  Box box() {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      const Real size = whole_.extent()[axis], side = size * std::pow(10., -9 * std::pow(uniform(), 2));
      box.lo[axis] = std::clamp(whole_.lo[axis] + uniform() * (size - side), whole_.lo[axis], whole_.hi[axis]);
      box.hi[axis] = std::clamp(box.lo[axis] + side, box.lo[axis], whole_.hi[axis]);
    }
    return box;
  }

  /// In any direction, every third along an axis; it begins off 0.
  Ray ray(int number) {
    Ray ray;
    std::normal_distribution<Real> normal;
    ray.direction = Vec3(normal(random_), normal(random_), normal(random_)).normalized();
    if (number % 3 == 0) ray.direction = Vec3::Unit(number / 3 % 3) * (number % 2 == 0 ? 1 : -1);
    ray.origin = point(whole_) - uniform(0, 2) * ray.direction;
    ray.begin = 0;
    return clipped(ray, whole_);
  }

  Spectrum look_up(const Vec3& p) const {
    Spectrum mu = Spectrum::Zero(medium_.channels());
    medium_.extinction({&p[0], &p[1], &p[2], 1}, mu.data());
    return mu;
  }

  void add(const char* what, const std::string& counterexample) {
    findings_.push_back({what, counterexample.empty(), counterexample});
  }

  static std::string place(const Vec3& p) { return fmt::format("at ({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]); }

  void extinction() {
    std::string wrong, apart, single;
    constexpr std::size_t kBlock = 100;
    std::vector<Real> x(kBlock), y(kBlock), z(kBlock);
    std::vector<Real> out(kBlock * static_cast<std::size_t>(medium_.channels()));
    for (int block = 0; block < 100; ++block) {
      for (std::size_t i = 0; i < kBlock; ++i) {
        const Vec3 p = point(block % 2 == 0 ? whole_ : box());
        x[i] = p[0], y[i] = p[1], z[i] = p[2];
      }
      medium_.extinction({x.data(), y.data(), z.data(), kBlock}, out.data());
      for (std::size_t i = 0; i < kBlock; ++i) {
        const Vec3 p(x[i], y[i], z[i]);
        const Spectrum alone = look_up(p);
        for (int c = 0; c < medium_.channels(); ++c) {
          const Real mu = out[i * static_cast<std::size_t>(medium_.channels()) + static_cast<std::size_t>(c)];
          largest_ = std::max(largest_, mu);
          if (wrong.empty() && !(std::isfinite(mu) && mu >= 0)) wrong = fmt::format("{} {}", mu, place(p));
          if (apart.empty() && mu != alone[c]) apart = fmt::format("{:.17g} and {:.17g} {}", mu, alone[c], place(p));
        }
        if (medium_.channels() > 1 || !single.empty()) continue;
        const float sx = static_cast<float>(p[0]), sy = static_cast<float>(p[1]), sz = static_cast<float>(p[2]);
        float in_single = 0;
        medium_.extinction(SinglePoints{&sx, &sy, &sz, 1}, &in_single);
        const Vec3 rounded(sx, sy, sz);
        if (!(std::abs(in_single - look_up(rounded)[0]) <= 1e-5 * largest_)) {
          // Where the extinction jumps between neighbouring floats either side is right.
          const Extrema near = medium_.extrema(
              {(rounded - 1e-6 * whole_.extent()).cwiseMax(whole_.lo), (rounded + 1e-6 * whole_.extent()).cwiseMin(whole_.hi)});
          if (!(in_single >= near.minimum[0] - 1e-5 * largest_ && in_single <= near.maximum[0] + 1e-5 * largest_))
            single = fmt::format("{} and {} {}", in_single, look_up(rounded)[0], place(p));
        }
      }
    }
    add("extinction is finite and not negative", wrong);
    add("a block of lookups gives what single lookups give", apart);
    if (medium_.channels() == 1) add("lookups in float agree with double", single);
  }

  void extrema() {
    std::string outside, average;
    for (int i = 0; i < 2000; ++i) {
      const Box b = i == 0 ? whole_ : box();
      const Extrema found = medium_.extrema(b);
      for (int c = 0; c < medium_.channels() && average.empty(); ++c)
        if (!(found.minimum[c] <= found.average[c] && found.average[c] <= found.maximum[c] && found.minimum[c] >= 0))
          average = fmt::format("{} <= {} <= {} does not hold", found.minimum[c], found.average[c], found.maximum[c]);
      for (int k = 0; k < 40 && outside.empty(); ++k) {
        const Vec3 p = point(b);
        const Spectrum mu = look_up(p);
        for (int c = 0; c < medium_.channels(); ++c)
          if (!(found.minimum[c] <= mu[c] && mu[c] <= found.maximum[c]))
            outside = fmt::format("{:.9g} outside [{:.9g}, {:.9g}] {}", mu[c], found.minimum[c], found.maximum[c], place(p));
      }
    }
    add("extrema bound the extinction", outside);
    add("the average lies between the extrema", average);
  }

  /// Between neighbouring knots, by a rule; the knots are in `cuts`.
  template <class Rule>
  Real integral(const Ray& ray, const std::vector<Real>& cuts, int channel, const Rule& rule) const {
    Real sum = 0;
    for (std::size_t i = 1; i < cuts.size(); ++i)
      if (cuts[i] > cuts[i - 1]) sum += rule([&](Real t) { return look_up(ray.at(t))[channel]; }, cuts[i - 1], cuts[i]);
    return sum;
  }

  void optical_depth() {
    constexpr int kRays = 200;
    std::string knots, depth, inverse;
    bool closed_form = false, inverts = false;
    for (int i = 0; i < kRays; ++i) {
      const Ray r = ray(i);
      if (!(r.end > r.begin)) continue;
      std::vector<Real> cuts;
      medium_.knots(r, cuts);
      for (const Real t : cuts)
        if (knots.empty() && !(t > r.begin && t < r.end)) knots = fmt::format("{} outside ({}, {})", t, r.begin, r.end);
      cuts.push_back(r.begin);
      cuts.push_back(r.end);
      std::sort(cuts.begin(), cuts.end());
      const auto closed = medium_.optical_depth(r);
      closed_form |= closed.has_value();
      for (int c = 0; c < medium_.channels() && depth.empty(); ++c) {
        const auto kronrod = [](const auto& f, Real a, Real b) {
          return boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(f, a, b, 6, 1e-12);
        };
        const Real integrated = integral(r, cuts, c, kronrod), scale = std::max(integrated, largest_ * (r.end - r.begin) * 1e-3);
        if (closed && !(std::abs((*closed)[c] - integrated) <= 1e-9 * scale))
          depth = fmt::format("{:.15g} in closed form, {:.15g} integrated, {}", (*closed)[c], integrated, place(r.at(r.begin)));
        if (!closed && !(std::abs(panels(r, c) - integrated) <= 1e-3 * scale))
          depth = fmt::format("{:.9g} between knots, {:.9g} by 4096 panels, {}", integrated, panels(r, c), place(r.at(r.begin)));
      }
      if (medium_.channels() > 1 || !closed || !inverse.empty()) continue;
      const Real target = uniform() * (*closed)[0];
      const auto t = medium_.distance_at_depth(r, target);
      if (!t) continue;
      inverts = true;
      Ray part = r;
      part.end = std::min(*t, r.end);
      const auto back = medium_.optical_depth(part);
      if (!(back && std::abs((*back)[0] - target) <= 1e-9 * (*closed)[0]))
        inverse = fmt::format("depth {:.15g} leads to distance {:.15g}, whose depth is {:.15g}", target, *t,
                              back ? (*back)[0] : kInfinity);
    }
    add("knots lie inside their ray", knots);
    add(closed_form ? "the closed form of the optical depth is the integral of the extinction" : "knots resolve the extinction",
        depth);
    if (inverts) add("the distance at a depth leads back to the depth", inverse);
  }

  /// Blind to knots.
  Real panels(const Ray& r, int channel) const {
    std::vector<Real> cuts;
    constexpr int kPanels = 4096;
    for (int i = 0; i <= kPanels; ++i) cuts.push_back(r.begin + (r.end - r.begin) * i / kPanels);
    return integral(r, cuts, channel,
                    [](const auto& f, Real a, Real b) { return boost::math::quadrature::gauss<Real, 7>::integrate(f, a, b); });
  }

  const Medium& medium_;
  Box whole_;
  Real largest_ = 0;
  std::mt19937_64 random_{17};
  std::vector<ContractFinding> findings_;
};

}  // namespace

std::vector<ContractFinding> check_medium(const Medium& medium) { return MediumContract(medium).findings(); }

std::vector<ContractFinding> check_medium(const Json& medium) {
  std::vector<ContractFinding> all;
  for (const MediumSpec& spec : read_media(JsonNode(medium, "prove"))) {
    const BuiltMedium built = build_medium(spec);
    for (ContractFinding& finding : check_medium(*built.medium)) {
      finding.what = spec.label + ": " + finding.what;
      all.push_back(std::move(finding));
    }
  }
  return all;
}

}  // namespace nullmark
