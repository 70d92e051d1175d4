"""The process that a configuration's {"type": "process"} starts: python3 -m nullmark serve FILE [NAME]."""

import importlib.util
import json
import os
import struct
import sys
import traceback

import numpy as np

from .frames import FAILED, PING, RAY, RESULT, SAMPLE, STOPPED, THEORY, VALUES, Harness, Stream, read_ray
from .tracker import QUANTITIES, Samples, Stopped, Tracker

_SAMPLE = struct.Struct("<2Qq2i")
_THEORY = struct.Struct("<2i")
_NAMES = {bit: name for name, bit in QUANTITIES.items()}


class Loaded(Exception):
    """What comes after the trackers in a file: it calls judge, which must not begin in the tracker's own process."""


def load(path, name):
    """The tracker of a Python file: the one of that name, or its only one."""
    path = os.path.abspath(path)
    sys.path.insert(0, os.path.dirname(path))
    spec = importlib.util.spec_from_file_location("nullmark_served", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    os.environ["NULLMARK_SERVING"] = "1"
    try:
        spec.loader.exec_module(module)
    except Loaded:
        pass
    found = {one.name: one for one in vars(module).values() if isinstance(one, Tracker)}
    if name is None and len(found) == 1:
        return next(iter(found.values()))
    if name in found:
        return found[name]
    names = ", ".join(found) or "none"
    raise ValueError(f"{path}: no tracker {name!r}" if name else f"{path}: name one of its trackers: {names}")


def _line(error):
    """An exception as one line that names the last frame of its traceback."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({os.path.basename(frames[-1].filename)}:{frames[-1].lineno}, {frames[-1].name})" if frames else ""
    return f"{type(error).__name__}: {error}{where}".replace("\n", " ").encode()


def _array(values, shape, dtype, what):
    array = np.ascontiguousarray(values, dtype)
    if array.shape != shape and array.size == int(np.prod(shape)):
        array = array.reshape(shape)
    if array.shape != shape:
        raise ValueError(f"{what} has shape {np.shape(values)}; expected {shape}")
    return array


def _results(tracker, ray, samples):
    """The arrays of a result's frame, in its order."""
    returned, lookups = tracker(ray, samples), []
    if tracker.own_medium:
        *returned, told = returned
        returned = returned[0] if len(returned) == 1 else tuple(returned)
        lookups = [_array(told, (samples.count,), np.uint64, "lookups")]
    shape = (samples.count, ray.channels)
    if samples.quantity != "free_path":
        return [_array(returned, shape, np.float64, "the result"), *lookups]
    distance, event, weight = returned
    return [
        _array(distance, (samples.count,), np.float64, "distance"),
        _array(weight, shape, np.float64, "weight"),
        *lookups,
        _array(event, (samples.count,), np.uint8, "event"),
    ]


class Server:
    """One tracker behind a stream."""

    def __init__(self, stream, path, name):
        self._stream, self._harness, self._ray = stream, Harness(stream), None

        def tracker_of(parameters):
            tracker = load(path, name)
            tracker.parameters = json.loads(parameters)
            return tracker

        self._tracker = stream.greet(tracker_of)

    def run(self):
        while True:
            kind, payload = self._stream.receive()
            if kind == RAY:
                self._ray = read_ray(payload)
            elif kind == SAMPLE:
                self._sample(payload)
            elif kind == THEORY:
                quantity, channel = _THEORY.unpack(payload)
                told = self._tracker.theory(self._ray, _NAMES[quantity], channel)
                self._stream.send(VALUES, b"" if told is None else np.array(told, np.float64))
            elif kind == PING:
                self._stream.send(VALUES, bytes(payload))
            else:
                raise ValueError(f"found frame {kind}; expected a ray, a request for samples or for theory")

    def _sample(self, payload):
        key, first, count, quantity, _ = _SAMPLE.unpack(payload)
        samples = Samples(self._harness, self._ray, count, first, key, _NAMES[quantity])
        try:
            arrays = _results(self._tracker, self._ray, samples)
        except Stopped:
            self._stream.send(STOPPED)
            return
        self._stream.send(RESULT, *arrays)


def serve(path, name=None):
    """Serves until the harness ends.  What the tracker prints goes to standard error."""
    output = os.dup(1)
    os.dup2(2, 1)
    stream = Stream(0, output)
    try:
        Server(stream, path, name).run()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass
    except BaseException as error:  # the harness shows it as the cell's error
        stream.send(FAILED, _line(error))
        sys.exit(1)
