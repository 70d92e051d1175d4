// One instruction set, the build's own: dynamic dispatch would let results depend on the machine that runs them.
#define HWY_COMPILE_ONLY_STATIC
#include "media/logarithm.h"

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <algorithm>

namespace nullmark {

namespace hn = hwy::HWY_NAMESPACE;

void negative_logarithms(const Real* x, std::size_t n, Real* out) {
  const hn::ScalableTag<Real> lanes;
  const std::size_t width = hn::Lanes(lanes);
  std::size_t i = 0;
  for (; i + width <= n; i += width) hn::StoreU(hn::Neg(hn::Log(lanes, hn::LoadU(lanes, x + i))), lanes, out + i);
  if (i == n) return;
  Real rest[HWY_MAX_BYTES / sizeof(Real)];
  std::fill(std::copy(x + i, x + n, rest), std::end(rest), Real{1});
  hn::StoreU(hn::Neg(hn::Log(lanes, hn::LoadU(lanes, rest))), lanes, rest);
  std::copy(rest, rest + (n - i), out + i);
}

}  // namespace nullmark
