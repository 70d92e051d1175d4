#!/usr/bin/python3
"""A tracker's process that breaks the protocol in one way: faulty_process.py FAULT.  Without a fault every sample is 1."""

import json
import os
import struct
import sys
import time

HEADER, GREETING = struct.Struct("<4I"), struct.Struct("<8s4I")
WELCOME, RAY, SAMPLE, LOOKUP, VALUES, RESULT, PING = 2, 3, 5, 6, 11, 12, 16
fault = sys.argv[1] if len(sys.argv) > 1 else ""
sent = 0


def exactly(size):
    data = b""
    while len(data) < size:
        part = os.read(0, size - len(data))
        if not part:
            sys.exit(0)
        data += part
    return data


def send(kind, payload, sequence=None, size=None):
    global sent
    data = HEADER.pack(kind, len(payload) if size is None else size, sent if sequence is None else sequence, 0) + payload
    sent += 1
    while data:
        data = data[os.write(1, data) :]


def receive():
    kind, size, _, _ = HEADER.unpack(exactly(HEADER.size))
    return kind, exactly(size)


receive()
if fault == "silent":
    time.sleep(1000)
magic = b"NULLMARK" if fault == "magic" else b"nullmark"
greeting = GREETING.pack(magic, 9 if fault == "version" else 1, 0x04030201 if fault == "endian" else 0x01020304, 0, 0)
told = {"name": "faulty", "quantities": ["transmittance"], "guarantee": "unbiased", "range": "unit"}
if fault == "words":
    told["range"] = "positive"
send(WELCOME, greeting + (b"{" if fault == "json" else json.dumps(told).encode()))

while True:
    kind, payload = receive()
    if kind == PING:
        send(VALUES, payload)
    if kind != SAMPLE:
        continue
    _, _, count, _, _ = struct.unpack("<2Qq2i", payload)
    values = struct.pack("<d", 1.0) * count
    if fault == "dies":
        print("first line", file=sys.stderr)
        print("the last words", file=sys.stderr)
        sys.exit(3)
    elif fault == "killed":
        os.kill(os.getpid(), 9)
    elif fault == "hangs":
        time.sleep(1000)
    elif fault == "closes":
        os.close(0)
        os.close(1)
        time.sleep(1000)
    elif fault == "floods":
        while True:
            os.write(2, b"x" * 65536)
            os.write(1, b"\xff" * 65536)
    elif fault == "long":
        send(RESULT, b"", size=1 << 31)
    elif fault == "short":
        send(RESULT, values[:-8])
    elif fault == "sequence":
        send(RESULT, values, sequence=77)
    elif fault == "prints":
        os.write(1, b"hello, world, hello, world\n")
    elif fault == "unasked":
        send(RAY, values)
    elif fault == "index":
        send(LOOKUP, struct.pack("<2IdI", 1, 0, 0.5, 1 << 30))
    elif fault == "shared":
        data = HEADER.pack(RESULT, len(values), sent, 1)
        os.write(1, data)
    elif fault == "nan":
        send(RESULT, struct.pack("<d", float("nan")) * count)
    elif fault == "range":
        send(RESULT, struct.pack("<d", 2.0) * count)
    elif fault == "many":
        n = 1 << 20
        send(LOOKUP, struct.pack("<2I", n, 0) + bytes(12 * n))
    else:
        send(RESULT, values)
