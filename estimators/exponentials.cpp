// One instruction set, the build's own: dynamic dispatch would let results depend on the machine that runs them.
#define HWY_COMPILE_ONLY_STATIC
#include "estimators/exponentials.h"

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

namespace nullmark {

namespace hn = hwy::HWY_NAMESPACE;

void negative_logarithms(const Real* x, std::size_t n, Real* out) {
  const hn::ScalableTag<Real> lanes;
  for (std::size_t i = 0; i < n; i += hn::Lanes(lanes))
    hn::StoreU(hn::Neg(hn::Log(lanes, hn::LoadU(lanes, x + i))), lanes, out + i);
}

}  // namespace nullmark
