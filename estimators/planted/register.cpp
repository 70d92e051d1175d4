#include "estimators/planted/bin_shape.h"
#include "estimators/planted/budget.h"
#include "estimators/planted/channels.h"
#include "estimators/planted/clamped.h"
#include "estimators/planted/constants.h"
#include "estimators/planted/control_twice.h"
#include "estimators/planted/debiased.h"
#include "estimators/planted/decomposition.h"
#include "estimators/planted/decomposition_reset.h"
#include "estimators/planted/flight_rate.h"
#include "estimators/planted/half_depth.h"
#include "estimators/planted/killed.h"
#include "estimators/planted/learned_bound.h"
#include "estimators/planted/medium_average.h"
#include "estimators/planted/midpoint.h"
#include "estimators/planted/mis.h"
#include "estimators/planted/moments.h"
#include "estimators/planted/neighbour.h"
#include "estimators/planted/next_flight.h"
#include "estimators/planted/power_series.h"
#include "estimators/planted/previous_lookup.h"
#include "estimators/planted/rare_nan.h"
#include "estimators/planted/roulette.h"
#include "estimators/planted/segments.h"
#include "estimators/planted/slight.h"
#include "estimators/planted/spectral.h"
#include "estimators/planted/stated.h"
#include "estimators/planted/streams.h"
#include "estimators/planted/unit_length.h"
#include "estimators/planted/weighted.h"
#include "harness/registry.h"

namespace nullmark {

NULLMARK_REGISTER_PLANTED_BUG(PlantedBatchStreams, WrappedSource<PlantedBatchStreams>);
NULLMARK_REGISTER_PLANTED_BUG(PlantedBinShape);
NULLMARK_REGISTER_PLANTED_BUG(PlantedBudget);
NULLMARK_REGISTER_PLANTED_BUG(PlantedCappedExtinction);
NULLMARK_REGISTER_PLANTED_BUG(PlantedCarriedDistance);
NULLMARK_REGISTER_PLANTED_BUG(PlantedChannelMajorant);
NULLMARK_REGISTER_PLANTED_BUG(PlantedChannelSwap);
NULLMARK_REGISTER_PLANTED_BUG(PlantedClampedRatio);
NULLMARK_REGISTER_PLANTED_BUG(PlantedClampedResidual);
NULLMARK_REGISTER_PLANTED_BUG(PlantedCoin);
NULLMARK_REGISTER_PLANTED_BUG(PlantedControlTwice);
NULLMARK_REGISTER_PLANTED_BUG(PlantedDecompositionMarginal);
NULLMARK_REGISTER_PLANTED_BUG(PlantedDecompositionReset);
NULLMARK_REGISTER_PLANTED_BUG(PlantedDecompositionStart);
NULLMARK_REGISTER_PLANTED_BUG(PlantedEarlySurface);
NULLMARK_REGISTER_PLANTED_BUG(PlantedExact);
NULLMARK_REGISTER_PLANTED_BUG(PlantedFirstSegment);
NULLMARK_REGISTER_PLANTED_BUG(PlantedFlightRate);
NULLMARK_REGISTER_PLANTED_BUG(PlantedGuidedEscape);
NULLMARK_REGISTER_PLANTED_BUG(PlantedHalfDepth);
NULLMARK_REGISTER_PLANTED_BUG(PlantedHeroHistory);
NULLMARK_REGISTER_PLANTED_BUG(PlantedKilled);
NULLMARK_REGISTER_PLANTED_BUG(PlantedLastSegment);
NULLMARK_REGISTER_PLANTED_BUG(PlantedLearnedBound);
NULLMARK_REGISTER_PLANTED_BUG(PlantedLostEscape);
NULLMARK_REGISTER_PLANTED_BUG(PlantedLostWalks);
NULLMARK_REGISTER_PLANTED_BUG(PlantedMediumAverage);
NULLMARK_REGISTER_PLANTED_BUG(PlantedMidpoint);
NULLMARK_REGISTER_PLANTED_BUG(PlantedNan);
NULLMARK_REGISTER_PLANTED_BUG(PlantedNeighbour, WrappedSource<PlantedNeighbour>);
NULLMARK_REGISTER_PLANTED_BUG(PlantedNoRewind);
NULLMARK_REGISTER_PLANTED_BUG(PlantedPairedStreams, WrappedSource<PlantedPairedStreams>);
NULLMARK_REGISTER_PLANTED_BUG(PlantedPathStart);
NULLMARK_REGISTER_PLANTED_BUG(PlantedPreviousExtinction);
NULLMARK_REGISTER_PLANTED_BUG(PlantedRayStreams, WrappedSource<PlantedRayStreams>);
NULLMARK_REGISTER_PLANTED_BUG(PlantedReference);
NULLMARK_REGISTER_PLANTED_BUG(PlantedRoulette);
NULLMARK_REGISTER_PLANTED_BUG(PlantedSecondLookup);
NULLMARK_REGISTER_PLANTED_BUG(PlantedSharedOffset);
NULLMARK_REGISTER_PLANTED_BUG(PlantedSlight);
NULLMARK_REGISTER_PLANTED_BUG(PlantedSpectralSum);
NULLMARK_REGISTER_PLANTED_BUG(PlantedStaleResidual);
NULLMARK_REGISTER_PLANTED_BUG(PlantedStepParenthesis);
NULLMARK_REGISTER_PLANTED_BUG(PlantedStrictTail);
NULLMARK_REGISTER_PLANTED_BUG(PlantedTerminalTerm);
NULLMARK_REGISTER_PLANTED_BUG(PlantedUnitLength);
NULLMARK_REGISTER_PLANTED_BUG(PlantedUnweightedLevel);
NULLMARK_REGISTER_PLANTED_BUG(PlantedVariance);
NULLMARK_REGISTER_PLANTED_BUG(PlantedWeightSign);
NULLMARK_REGISTER_PLANTED_BUG(PlantedWholeDepth);
NULLMARK_REGISTER_PLANTED_BUG(PlantedZero);

}  // namespace nullmark
