"""The tracker's side of the frames of harness/foreign/frames.h."""

import mmap
import os
import struct

import numpy as np

from .tracker import Ray, Stopped

HELLO, WELCOME, RAY, THEORY, SAMPLE, LOOKUP, LOOKUP_AT, UNIFORM, NEXT, STEP, VALUES, RESULT, STOP, STOPPED, FAILED, PING = range(1, 17)
VERSION, ENDIAN = 1, 0x01020304
_HEADER = struct.Struct("<4I")
_GREETING = struct.Struct("<8s4I")
_RAY = struct.Struct("<4iQ8d")
_LEAST_SHARED = 4096
MOST_REQUESTS = 4096


class Stream:
    """Frames over two descriptors and, if offered, the shared memory at descriptor 3."""

    def __init__(self, read, write):
        self._read, self._write, self._sent = read, write, 0
        self._memory, self._half, self._uses_memory = None, 0, False

    def _exactly(self, size):
        data = bytearray(size)
        view = memoryview(data)
        while view:
            n = os.readv(self._read, [view])
            if n == 0:
                raise EOFError
            view = view[n:]
        return data

    def receive(self):
        """(kind, payload)."""
        kind, size, _, shared = _HEADER.unpack(self._exactly(_HEADER.size))
        if shared:
            return kind, self._memory[:size]
        return kind, self._exactly(size)

    def send(self, kind, *parts):
        """Parts are bytes or arrays."""
        parts = [memoryview(part).cast("B") if len(part) else memoryview(b"") for part in parts]
        size, shared = sum(len(part) for part in parts), 0
        if self._uses_memory and _LEAST_SHARED <= size <= self._half:
            at = self._half
            for part in parts:
                self._memory[at : at + len(part)] = part
                at += len(part)
            parts, shared = [], 1
        data = [memoryview(_HEADER.pack(kind, size, self._sent, shared)), *parts]
        self._sent += 1
        while data:
            n = os.writev(self._write, data)
            while data and n >= len(data[0]):
                n -= len(data[0])
                data.pop(0)
            if data:
                data[0] = data[0][n:]

    def greet(self, tracker_of):
        """Answers the harness's greeting with the welcome of tracker_of(parameters), and returns the tracker."""
        kind, payload = self.receive()
        if kind != HELLO:
            raise ValueError(f"the first frame is {kind}; expected a greeting")
        magic, version, endian, shared_bytes, _ = _GREETING.unpack_from(payload)
        if magic != b"nullmark" or endian != ENDIAN or version != VERSION:
            raise ValueError(f"found version {version} of the frames; expected {VERSION}: update the Python package")
        tracker = tracker_of(bytes(payload[_GREETING.size :]).decode())
        if shared_bytes:
            self._memory = mmap.mmap(3, shared_bytes)
            self._half = shared_bytes // 2
        self.send(WELCOME, _GREETING.pack(b"nullmark", VERSION, ENDIAN, 0, 0), tracker.welcome(bool(shared_bytes)))
        self._uses_memory = bool(shared_bytes)
        return tracker


def read_ray(payload):
    """The ray of a frame."""
    channels, segments, crossing, _, ray_id, *numbers = _RAY.unpack_from(payload)
    rest = np.frombuffer(payload, np.float64, offset=_RAY.size).copy()
    ends = np.cumsum([segments, segments] + 3 * [segments * channels])
    segment_end, rate, minimum, average, maximum, albedo = np.split(rest, ends)
    return Ray(
        ray_id,
        channels,
        crossing,
        np.array(numbers[0:3]),
        np.array(numbers[3:6]),
        numbers[6],
        numbers[7],
        segment_end,
        rate,
        minimum.reshape(segments, channels),
        average.reshape(segments, channels),
        maximum.reshape(segments, channels),
        albedo,
    )


class Harness:
    """The calls of a Samples object, as frames."""

    def __init__(self, stream):
        self._stream = stream

    def _ask(self, kind, alive, numbers=None):
        alive = np.ascontiguousarray(alive, np.uint32)
        head = struct.pack("<2I", len(alive), 0)
        parts = [head, alive] if numbers is None else [head, numbers, alive]
        self._stream.send(kind, *parts)
        answer, payload = self._stream.receive()
        if answer == STOP:
            raise Stopped
        if answer != VALUES:
            raise ValueError(f"found frame {answer}; expected values")
        return np.frombuffer(payload, np.float64)

    def _in_parts(self, kind, alive, numbers=None, each=1):
        """Frames of bounded size; (parts of) the answers in a list."""
        alive = np.asarray(alive)
        for at in range(0, max(len(alive), 1), MOST_REQUESTS):
            part = slice(at, at + MOST_REQUESTS)
            of_part = None if numbers is None else numbers[at * each : (at + MOST_REQUESTS) * each]
            yield self._ask(kind, alive[part], of_part)

    def lookup(self, alive, t):
        t = np.ascontiguousarray(np.broadcast_to(t, np.shape(alive)), np.float64)
        return np.concatenate(list(self._in_parts(LOOKUP, alive, t)))

    def lookup_at(self, alive, points):
        points = np.ascontiguousarray(points, np.float64).reshape(-1)
        return np.concatenate(list(self._in_parts(LOOKUP_AT, alive, points, 3)))

    def uniform(self, alive):
        return np.concatenate(list(self._in_parts(UNIFORM, alive)))

    def next(self, alive):
        parts = [answer.reshape(2, -1) for answer in self._in_parts(NEXT, alive)]
        t, rate = np.concatenate(parts, axis=1)
        return t, rate

    def step(self, alive, channels):
        parts = []
        for answer in self._in_parts(STEP, alive):
            n = len(answer) // (2 + channels)
            parts.append((answer[:n], answer[n : 2 * n], answer[2 * n :].reshape(n, channels)))
        return tuple(np.concatenate(arrays) for arrays in zip(*parts))
