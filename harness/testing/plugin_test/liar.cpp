#include "harness/registry/register_estimator.h"
#include "lying_tracker.h"

namespace nullmark {

NULLMARK_REGISTER_ESTIMATOR(LyingTracker);

}  // namespace nullmark
