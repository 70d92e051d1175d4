#pragma once

#include <functional>

#include "harness/model/plan.h"

namespace nullmark {

/// Throws ParameterError for a ray set where the rays of the wanted cells, by their place in the plan, take more memory than the
/// machine has: before any of it is asked for, because the system would end the program without a word.
void expect_rays_fit(const Plan& plan, const std::function<bool(std::size_t)>& wanted);

}  // namespace nullmark
