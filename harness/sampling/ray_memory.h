#pragma once

#include <functional>

#include "harness/model/plan.h"

namespace nullmark {

/// Throws ParameterError for a ray set if the rays of the wanted cells (by index in the plan) take more memory than the machine
/// has.  Checked before the memory is allocated, because the system would kill the program without a message.
void expect_rays_fit(const Plan& plan, const std::function<bool(std::size_t)>& wanted);

}  // namespace nullmark
