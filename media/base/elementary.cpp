#include "media/base/elementary.h"

#include <algorithm>

#include "media/base/lanes.h"

namespace nullmark {

namespace {

using One = Lanes<Real, 1>;

Real only(One lane) {
  Real x;
  lane.store(&x);
  return x;
}

/// map_lanes, in narrower registers where there are too few numbers for one: to fill it would cost more.  The results are the
/// same.
template <class Function>
void map(const Real* x, std::size_t n, Real* out, const Function& f) {
  if (n >= kNativeLanes<Real>) return map_lanes(x, n, out, f);
  constexpr std::size_t kHalf = std::max<std::size_t>(1, kNativeLanes<Real> / 2);
  std::size_t i = 0;
  for (; i + kHalf <= n; i += kHalf) f(Lanes<Real, kHalf>::load(x + i)).store(out + i);
  for (; i < n; ++i) f(One(x[i])).store(out + i);
}

}  // namespace

Real negative_logarithm(Real x) { return only(negative_logarithm(One(x))); }

Real exponential(Real x) { return only(exponential(One(x))); }

Real cosine(Real x) { return only(cosine(One(x))); }

Real one_minus_exponential(Real x) { return only(one_minus_exponential(One(x))); }

void negative_logarithms(const Real* x, std::size_t n, Real* out) {
  map(x, n, out, [](auto lanes) { return negative_logarithm(lanes); });
}

void exponentials(const Real* x, std::size_t n, Real* out) {
  map(x, n, out, [](auto lanes) { return exponential(lanes); });
}

}  // namespace nullmark
