// A tracker that does to the program what plug-ins may do: nullmark_faulty is the program with it.

#include <time.h>

#include <exception>
#include <stdexcept>

#include "estimators/ratio.h"
#include "harness/registry/plugin.h"
#include "harness/registry/register_estimator.h"

namespace nullmark {

/// Ratio tracking that misbehaves.
///
///   throws        in each flight
///   theory        throws where it is asked for its moments
///   crashes       writes to address 0 in each flight
///   terminates    does what an exception does where none may be thrown
///   rate_first    asks for the rate before its first flight
///   sleeps        a thousand seconds, in its first flight, whatever it is asked meanwhile
///   slow_theory   the same, where it is asked for its moments
///   honest        does nothing of this
template <class Value>
struct FaultyTracker : RatioTracking<Value> {
  static constexpr const char* kName = "faulty";
  static constexpr const char* kSummary = "ratio tracking that throws, crashes or never ends";
  static constexpr const char* kSource = "nullmark, test of the program";
  static constexpr bool kLanes = false;

  std::string fault = "throws";

  void parameters(ParameterVisitor& visit) {
    visit.choice("fault", fault, {"throws", "theory", "crashes", "terminates", "rate_first", "sleeps", "slow_theory", "honest"},
                 "what it does");
  }

  struct Walk {
    Value weight;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto&) const {
    walk.weight = ray.value(1);
    if (fault == "rate_first" && flight.rate() < 0) walk.weight = ray.value(0);
  }

  bool propose(Walk&, const MediumRay<Value>&, Flight& flight, auto& rng) const {
    if (fault == "throws") throw std::runtime_error("no flight\ntoday");
    if (fault == "crashes") *nowhere() = 1;
    if (fault == "terminates") terminate();
    if (fault == "sleeps") sleep();
    return flight.next(rng);
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    walk.weight *= (at.rate() - extinction) / at.rate();
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.weight; }
  Value transmittance_at(const Walk& walk, const MediumRay<Value>&, Real) const { return walk.weight; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int channel, Quantity quantity) const {
    if (fault == "theory") throw std::runtime_error("no theory");
    if (fault == "slow_theory") sleep();
    return RatioTracking<Value>::theory(ray, profile, channel, quantity);
  }

 private:
  static volatile int* nowhere() {
    static volatile int* volatile address = nullptr;
    return address;
  }
  [[noreturn]] static void terminate() { std::terminate(); }
  static void sleep() {
    const timespec long_time{1000, 0};
    ::nanosleep(&long_time, nullptr);
  }
};

NULLMARK_PLUGIN("faulty", "7");
NULLMARK_REGISTER_ESTIMATOR(FaultyTracker);

}  // namespace nullmark
