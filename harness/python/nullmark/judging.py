"""Runs the nullmark program on a tracker, and reads its results."""

import inspect
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from .serving import Loaded
from .tracker import Tracker

# Blocks as large as those of sampling: in smaller ones a process would be timed waiting.
_TIMING = {"samples_per_traversal": 4096}
_PACKAGE = Path(__file__).resolve().parent


class NullmarkError(RuntimeError):
    """The program refuses its input; the text is its line."""


def program():
    """The nullmark program: NULLMARK_PROGRAM, or of this repository, or found in PATH."""
    own = _PACKAGE.parents[2] / "build" / "release" / "nullmark"
    for found in (os.environ.get("NULLMARK_PROGRAM"), own, shutil.which("nullmark")):
        if found and os.access(found, os.X_OK):
            return str(found)
    raise NullmarkError("no nullmark program; build it, put it in PATH, or set NULLMARK_PROGRAM to its path")


def _environment():
    folders = [str(_PACKAGE.parent), os.environ.get("PYTHONPATH", "")]
    # numpy's own threads would wait for each other; processes are enough.
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, folders)), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def _run(*words, accept=(0,)):
    done = subprocess.run([program(), *words], capture_output=True, text=True, env=_environment())
    if done.returncode not in accept:
        lines = done.stderr.strip().splitlines()
        raise NullmarkError(lines[-1] if lines else f"nullmark {words[0]} ended with exit code {done.returncode}")
    return done


def _records(path):
    """Every cell of a results file, as its dictionary with the words of `check`."""
    return [json.loads(line) for line in _run("export", str(path), "--format", "jsonl").stdout.splitlines()]


def _at(values, channel):
    return values[channel] if isinstance(values, list) else values


def _rows(record):
    """A tidy row for each channel or output of a cell."""
    time, verdict = record.get("time") or {}, record.get("verdict") or {}
    outputs = record.get("outputs") or []
    count = len(outputs) or (len(record["mean"]) if isinstance(record["mean"], list) else 1)
    for channel in range(count):
        row = {
            "cell": record["name"],
            "experiment": record["experiment"],
            "estimator": record["estimator"]["label"],
            "tracker": record["estimator"].get("tracker", record["estimator"]["type"]),
            "medium": record["medium"]["label"],
            "majorant": record["majorant"]["label"],
            "quantity": record["quantity"],
            "channel": channel,
            "output": outputs[channel] if outputs else "",
            "status": record["status"],
            "word": record["word"],
            "finding": record["finding"],
            "samples": record["samples"],
            "verdict_samples_per_ray": verdict.get("samples_per_ray"),
            "reference": _at(record["reference"]["value"], channel),
            "lookups_per_sample": record.get("lookups_per_sample"),
            "ns_per_sample": time.get("ns_per_sample"),
            "ns_per_lookup": time.get("ns_per_lookup"),
        }
        for figure in ("mean", "bias", "rmse", "variance", "variance_theory"):
            row[figure] = _at(record.get(figure), channel)
        for kind in ("estimator", "medium", "majorant"):
            row.update({f"{kind}.{key}": value for key, value in record[kind]["params"].items()})
        yield row


def _frame(records):
    try:
        import pandas
    except ImportError as error:
        raise NullmarkError("a frame needs pandas: apt-get install python3-pandas") from error
    frame = pandas.DataFrame([row for record in records for row in _rows(record)])
    if {"variance", "ns_per_sample"} <= set(frame.columns):
        frame["variance_x_ns"] = frame["variance"] * frame["ns_per_sample"]
    return frame


def results(path):
    """A results file as a tidy pandas frame: a row for each cell and channel."""
    return _frame(_records(path))


class Verdict:
    """What nullmark says: `text` as `check` prints it, `passed`, `exit_code`, `records`, `frame`, `plot`."""

    def __init__(self, path):
        self.path = str(path)
        checked = _run("check", self.path, "--all", accept=(0, 1, 3, 5, 77))
        self.text, self.exit_code = checked.stdout, checked.returncode
        self.records = _records(path)

    @property
    def passed(self):
        return self.exit_code == 0

    @property
    def frame(self):
        return _frame(self.records)

    def __str__(self):
        return self.text

    __repr__ = __str__

    def plot(self, figure="variance_x_ns"):
        """A bar for each cell of a column of `frame`; returns the matplotlib axes."""
        try:
            import matplotlib.pyplot as plt
        except ImportError as error:
            raise NullmarkError("a plot needs matplotlib: apt-get install python3-matplotlib") from error
        frame = self.frame.dropna(subset=[figure])
        axes = plt.figure(figsize=(8, 1 + 0.3 * len(frame))).add_subplot()
        colours = {"PASS": "tab:green", "FAIL": "tab:red"}
        axes.barh(frame["tracker"] + ", " + frame["medium"], frame[figure], color=[colours.get(w, "tab:gray") for w in frame["word"]])
        axes.set_xscale("log")
        axes.set_xlabel(figure.replace("variance_x_ns", "variance times time per sample [ns]"))
        axes.invert_yaxis()
        axes.figure.tight_layout()
        return axes


def _medium(medium):
    """A name, an object, or the path of a volume."""
    if isinstance(medium, (str, Path)) and str(medium).endswith(".vdb"):
        return {"type": "vdb", "file": str(Path(medium).resolve())}
    return medium


def estimator(tracker):
    """A tracker as an object of a configuration; names and objects pass."""
    if callable(tracker) and not isinstance(tracker, Tracker):
        raise NullmarkError(f"{getattr(tracker, '__name__', tracker)} is no tracker; decorate it with @nullmark.tracker")
    if not isinstance(tracker, Tracker):
        return tracker
    try:
        path = inspect.getsourcefile(tracker.function)
    except TypeError:
        path = None
    if not path or not os.path.exists(path):
        raise NullmarkError(f"{tracker.name} has no file; expected it in a file, which its processes load")
    command = [sys.executable, "-m", "nullmark", "serve", os.path.abspath(path), tracker.name]
    made = {"type": "process", "command": command, "label": tracker.name}
    if tracker.parameters:
        made["parameters"] = tracker.parameters
    return made


def judge(*trackers, media=("cosine",), majorants=("global",), rays="single", quantity="transmittance", samples=65536, verdict=None,
          timing=True, threads=0, output=None):
    """Runs trackers - of this package, names of built-in ones, or objects of a configuration - and returns a Verdict.

    media, majorants, rays, quantity, samples (per ray) and verdict are as in a configuration; left out, a verdict may take four
    million samples of a ray.  A medium may be the path of a volume.  output: keep the results in this file.
    """
    if os.environ.get("NULLMARK_SERVING"):
        raise Loaded
    as_list = lambda value: list(value) if isinstance(value, (list, tuple)) else [value]
    experiment = {
        "name": "judge",
        "quantity": quantity,
        "rays": rays,
        "samples_per_ray": samples,
        "verdict": {"max_samples_per_ray": 1 << 22} if verdict is None else verdict,
        "matrix": {
            "estimator": [estimator(one) for one in trackers],
            "medium": [_medium(one) for one in as_list(media)],
            "majorant": as_list(majorants),
        },
    }
    with tempfile.TemporaryDirectory() as folder:
        config, made = Path(folder) / "judge.json", Path(folder) / "results.json"
        config.write_text(json.dumps({"nullmark": "config/2", "name": "judge", "timing": _TIMING, "experiments": [experiment]}))
        words = [] if timing else ["--no-timing"]
        _run("run", str(config), "-o", str(made), "--allow-foreign", "--threads", str(threads), *words, accept=(0, 1, 5))
        if output:
            shutil.copy(made, output)
        return Verdict(made)
