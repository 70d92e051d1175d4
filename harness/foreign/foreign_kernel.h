#pragma once

#include <memory>

#include "harness/foreign/foreign_tracker.h"
#include "harness/kernel/kernel.h"

namespace nullmark {

/// The loop of a tracker from elsewhere: hands it blocks of samples and scores what it returns.  A tracker's faults are thrown as
/// TrackerFailure.
std::unique_ptr<const Kernel> make_foreign_kernel(std::shared_ptr<const ForeignTracker> tracker, int channels);

}  // namespace nullmark
