#pragma once

#include "media/base/types.h"

namespace nullmark {

/// How a flight through the medium ends.  `collision`: absorbed or scattered, left to the scene's albedo; samplers that choose
/// between the two themselves say which.  `escape`: left the medium; `surface`: met an opaque surface.
enum class EventKind { escape, surface, collision, absorb, scatter };

inline bool is_collision(EventKind kind) { return kind >= EventKind::collision; }

/// One free flight: where it ended, how, and the weight that makes it unbiased, per channel.  For every interval dt of the ray,
/// E[w; collision in dt] = mu(t) T(t) dt (and mu_a, mu_s in place of mu for the kinds apart), E[w; escape] = T [Kutz et al.
/// 2017, Sec. 3].
template <class Value>
struct Event {
  EventKind kind = EventKind::escape;
  Real distance = 0;  ///< world length; the ray's end where nothing was met
  Value weight;
};

}  // namespace nullmark
