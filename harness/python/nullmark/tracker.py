"""What a tracker's function sees, and the decorator that describes it."""

import inspect
import json
from dataclasses import dataclass, field

import numpy as np

QUANTITIES = {"transmittance": 1, "optical_depth": 2, "free_path": 4}
GUARANTEES = ("exact", "unbiased", "consistent", "biased")
RANGES = ("binary", "unit", "non_negative", "signed")
ESCAPED, ABSORBED, SCATTERED, COLLIDED = range(4)


class Stopped(Exception):
    """The harness ends the cell: a budget is spent, or a signal came.  A tracker lets it pass."""


@dataclass
class Ray:
    """x(t) = origin + t direction for t in [begin, end], in world lengths.

    Segments are contiguous: segment_end (s,), rate (s,) of tentative collisions; minimum, average, maximum (s, channels) of the
    extinction; albedo (channels,).  crossing: 0 if a flight carries its exponential into the next segment, 1 if it is drawn anew.
    """

    id: int
    channels: int
    crossing: int
    origin: np.ndarray
    direction: np.ndarray
    begin: float
    end: float
    segment_end: np.ndarray
    rate: np.ndarray
    minimum: np.ndarray
    average: np.ndarray
    maximum: np.ndarray
    albedo: np.ndarray


class Samples:
    """The samples of one call.  `alive` are indices from 0 to count - 1; all methods take and give arrays."""

    def __init__(self, harness, ray, count, first, key, quantity):
        self._harness, self._ray = harness, ray
        self.count, self.first, self.key, self.quantity = count, first, key, quantity

    def all(self):
        """Indices of all samples, (count,)."""
        return np.arange(self.count, dtype=np.uint32)

    def ones(self):
        """(count, channels)."""
        return np.ones((self.count, self._ray.channels))

    def zeros(self):
        """(count, channels)."""
        return np.zeros((self.count, self._ray.channels))

    def lookup(self, alive, t):
        """Extinction at distances t (n,): (n, channels).  Each is counted as a lookup of its sample."""
        return self._harness.lookup(alive, t).reshape(-1, self._ray.channels)

    def lookup_at(self, alive, points):
        """Extinction at world points (n, 3): (n, channels)."""
        return self._harness.lookup_at(alive, points).reshape(-1, self._ray.channels)

    def uniform(self, alive):
        """Random numbers in [0, 1), (n,), from the stream of each sample."""
        return self._harness.uniform(alive)

    def next(self, alive):
        """Moves flights to their next tentative collision: (alive, t, rate) of those that have one."""
        t, rate = self._harness.next(alive)
        inside = np.isfinite(t)
        return np.asarray(alive)[inside], t[inside], rate[inside]

    def step(self, alive):
        """`next`, then `lookup`, in one exchange: (alive, t, rate, extinction)."""
        t, rate, extinction = self._harness.step(alive, self._ray.channels)
        inside = np.isfinite(t)
        return np.asarray(alive)[inside], t[inside], rate[inside], extinction[inside]


@dataclass
class Tracker:
    """A function with what it says of itself."""

    function: object
    name: str
    summary: str = ""
    source: str = ""
    version: str = ""
    quantities: tuple = ("transmittance",)
    guarantee: str = "unbiased"
    range: str = "signed"
    needs_bound: bool = False
    own_medium: bool = False
    streams: str = "harness"
    order: float = 0.0
    theory: object = None
    parameters: dict = field(default_factory=dict)

    def welcome(self, shared):
        """The text of the first frame."""
        told = {
            "name": self.name,
            "summary": self.summary,
            "source": self.source,
            "version": self.version,
            "quantities": list(self.quantities),
            "guarantee": self.guarantee,
            "range": self.range,
            "needs_bound": self.needs_bound,
            "own_medium": self.own_medium,
            "streams": self.streams,
            "theory": self.theory is not None,
            "shared": shared,
        }
        if self.order:
            told["order"] = self.order
        return json.dumps(told).encode()

    def __call__(self, ray, samples):
        return self.function(ray, samples, **self.parameters)


def _expect(word, words, what):
    if word not in words:
        raise ValueError(f"{what} {word!r}; expected one of {', '.join(words)}")


def tracker(function=None, **told):
    """Declares a function `f(ray, samples, **parameters)` to be a tracker.

    guarantee: "exact", "unbiased" (default), "consistent" or "biased"; range: "binary", "unit", "non_negative" or "signed"
    (default); needs_bound: unbiased only where the rate bounds the extinction; quantities: of "transmittance", "optical_depth" and
    "free_path"; own_medium: the tracker looks up a medium of its own; streams: "harness", "key" (its own, a function of
    samples.key, ray.id and sample) or "free"; theory: f(ray, quantity, channel) -> (mean, variance, lookups, lookups variance) or
    None, NaN where unknown; also name, summary, source, version and order.

    The function returns (count, channels) or, for one channel, (count,); with own_medium also the lookups, (count,).  Of free paths
    it returns distance (count,), event (count,) and weight (count, channels).
    """
    if function is None:
        return lambda f: tracker(f, **told)
    told.setdefault("name", function.__name__)
    doc = inspect.getdoc(function)
    told.setdefault("summary", doc.splitlines()[0] if doc else "")
    made = Tracker(function, **told)
    _expect(made.guarantee, GUARANTEES, "guarantee")
    _expect(made.range, RANGES, "range")
    _expect(made.streams, ("harness", "key", "free"), "streams")
    if isinstance(made.quantities, str):
        made.quantities = (made.quantities,)
    for quantity in made.quantities:
        _expect(quantity, QUANTITIES, "quantity")
    return made
