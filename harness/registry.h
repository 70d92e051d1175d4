#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "harness/block_kernel.h"
#include "media/registry.h"

namespace nullmark {

/// What `nullmark list` tells of an estimator.
struct EstimatorEntry {
  std::string name, summary, source;
  SampleRange range = SampleRange::any_sign;
  bool needs_bound = false;
  bool answers_optical_depth = false;
  std::unique_ptr<EstimatorSource> (*make)() = nullptr;
};

template <template <class> class Estimator>
EstimatorEntry estimator_entry() {
  using E = Estimator<Real>;
  return {.name = E::kName,
          .summary = E::kSummary,
          .source = E::kSource,
          .range = E::kRange,
          .needs_bound = E::kNeedsBound,
          .answers_optical_depth =
              requires(const E& e, typename E::Walk w, typename detail::RayOf<E, Real>::type r){e.optical_depth(w, r);
}
, .make = []() -> std::unique_ptr<EstimatorSource> { return std::make_unique<EstimatorTemplate<Estimator>>(); }
};  // namespace nullmark
}

}  // namespace nullmark

/// One line makes an estimator known to every command and to the contract tests.  In the tree the build writes it from
/// `nullmark_estimator(header Class)`; a plug-in writes it itself.
#define NULLMARK_REGISTER_ESTIMATOR(Estimator)                                                \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_estimator_, __COUNTER__) = \
      ::nullmark::Registry<::nullmark::EstimatorEntry>::instance().add(::nullmark::estimator_entry<Estimator>())
