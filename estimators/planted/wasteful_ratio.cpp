#include <cstdio>
#include <cstdlib>

#include "estimators/ratio.h"
#include "harness/registry/register_estimator.h"

namespace nullmark {
namespace {

/// Turns of an idle loop, of six instructions each, as the environment asks for them:
/// NULLMARK_WASTE=GREY,CHROMATIC,DEEP,START.  The first three are for each start of a walk (of as many walks as fill a register),
/// `deep` where the majorant's depth along the ray is above 20; the last is for each start of the program.
struct Waste {
  unsigned grey = 0, chromatic = 0, deep = 0, start = 0;

  Waste() {
    if (const char* asked = std::getenv("NULLMARK_WASTE")) std::sscanf(asked, "%u,%u,%u,%u", &grey, &chromatic, &deep, &start);
    spin(start);
  }

  static void spin(unsigned turns) {
    volatile unsigned turn = 0;
    while (turn < turns) turn = turn + 1;
  }
};

const Waste kWaste;

}  // namespace

/// Ratio tracking that gives the same numbers from the same lookups and draws, with more instructions.
template <class Value>
struct WastefulRatioTracking : RatioTracking<Value> {
  using typename RatioTracking<Value>::Walk;

  void init(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    constexpr bool chromatic = kIsChromatic<Value>;
    constexpr Real deep = 20;
    Waste::spin(ray.majorant.total_depth() > deep ? kWaste.deep : chromatic ? kWaste.chromatic : kWaste.grey);
  }
};

NULLMARK_REGISTER_ESTIMATOR(WastefulRatioTracking);

}  // namespace nullmark
