#pragma once

#include <boost/math/special_functions/gamma.hpp>

#include "media/base/types.h"

namespace nullmark {

/// ln i!, i >= 0.  Not std::lgamma, which writes a global sign that threads would race for.
inline Real log_factorial(Real i) { return boost::math::lgamma(i + 1); }

}  // namespace nullmark
