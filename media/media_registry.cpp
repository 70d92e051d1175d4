#include "media/canonical.h"
#include "media/checkerboard.h"
#include "media/cosine.h"
#include "media/exponential.h"
#include "media/exponential_cube.h"
#include "media/fractal_noise.h"
#include "media/gaussian_bump.h"
#include "media/gaussian_hole.h"
#include "media/homogeneous.h"
#include "media/layers.h"
#include "media/linear.h"
#include "media/polynomial.h"

namespace nullmark {

NULLMARK_REGISTER_MEDIUM(CanonicalMediumSource);
NULLMARK_REGISTER_MEDIUM(FieldSource<Checkerboard>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Cosine>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Exponential>);
NULLMARK_REGISTER_MEDIUM(FieldSource<ExponentialCube>);
NULLMARK_REGISTER_MEDIUM(FieldSource<FractalNoise>);
NULLMARK_REGISTER_MEDIUM(FieldSource<GaussianBump>);
NULLMARK_REGISTER_MEDIUM(FieldSource<GaussianHole>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Homogeneous>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Layers>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Linear>);
NULLMARK_REGISTER_MEDIUM(FieldSource<Polynomial>);

}  // namespace nullmark
