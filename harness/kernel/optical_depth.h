#pragma once

#include <vector>

#include "media/base/medium.h"

namespace nullmark {

/// Optical depth of a local ray and its error bound: closed form, else exact traversal of a piecewise polynomial, else adaptive
/// Gauss-Kronrod quadrature between knots.
struct DepthWithError {
  Spectrum depth, error;
  const char* method;
};
DepthWithError optical_depth(const Medium& medium, const Ray& local);

/// Begin, the medium's knots in between, end; sorted, without repetitions.
void sorted_knots(const Medium& medium, const Ray& local, std::vector<Real>& out);

}  // namespace nullmark
