#include "media/base/elementary.h"

#include "media/base/lanes.h"

namespace nullmark {

namespace {

using One = Lanes<Real, 1>;

Real only(One lane) {
  Real x;
  lane.store(&x);
  return x;
}

}  // namespace

Real negative_logarithm(Real x) { return only(negative_logarithm(One(x))); }

Real exponential(Real x) { return only(exponential(One(x))); }

void negative_logarithms(const Real* x, std::size_t n, Real* out) {
  map_lanes(x, n, out, [](auto lanes) { return negative_logarithm(lanes); });
}

void exponentials(const Real* x, std::size_t n, Real* out) {
  map_lanes(x, n, out, [](auto lanes) { return exponential(lanes); });
}

}  // namespace nullmark
