#pragma once

#include <span>

#include "media/base/types.h"

namespace nullmark {

/// -log of the bound 2 exp(-2 n D^2) on the chance that n independent uniforms' distribution is so far from the diagonal, D
/// the largest distance of theirs [Dvoretzky, Kiefer and Wolfowitz 1956; Massart 1990]; -inf for none.  Numbers outside [0, 1]
/// are as far as they are.  O(n) for anything like uniforms: only those are sorted among which D can lie.
Real uniformity(std::span<const Real> u);

}  // namespace nullmark
