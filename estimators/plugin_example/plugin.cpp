#include "harness/registry/plugin.h"
#include "harness/registry/register_estimator.h"
#include "media/base/field.h"
#include "ripples.h"
#include "roulette_ratio.h"

namespace nullmark {

NULLMARK_PLUGIN("example", "1.0");
NULLMARK_REGISTER_ESTIMATOR(RouletteRatioTracking);
NULLMARK_REGISTER_MEDIUM(FieldSource<Ripples>);

}  // namespace nullmark
