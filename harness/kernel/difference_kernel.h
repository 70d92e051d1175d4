#pragma once

#include <memory>

#include "harness/kernel/kernel.h"

namespace nullmark {

/// A kernel whose sample is one of `first` minus one of `second`, on streams of their own: its mean is 0 on each ray where both
/// have the same mean, and its variance is the sum of theirs.  Lookups and random numbers are those of both; recordings are of
/// `first`.  It answers transmittance, optical depth and radiance.
std::unique_ptr<const Kernel> make_difference_kernel(std::shared_ptr<const Kernel> first, std::shared_ptr<const Kernel> second);

}  // namespace nullmark
