"""The results that the page was made of, and what it must show of them."""

import json
import pathlib

FILES = []
CELLS = []  # of all results, in the order of the page
TABLES = []  # (table, cells of its run by name)
VERSIONS = []  # of the programs that measured


def timed():
    return any(cell.get("time") for cell in CELLS)


def as_list(value):
    return value if isinstance(value, list) else [value]


def read_results(files):
    FILES.extend(files)
    for file in files:
        run = json.loads(pathlib.Path(file).read_text())
        CELLS.extend(run["cells"])
        provenance = run["provenance"]
        VERSIONS.append(f"{provenance['version']} ({provenance['git']['commit'][:7]})")
        by_name = {cell["name"]: cell for cell in run["cells"]}
        TABLES.extend((table, by_name) for table in run.get("tables", []))


def numbers_of(cell):
    """What the page must show of a cell, by the name it has there."""
    timing = cell.get("time") or {}
    return {
        "mean": as_list(cell["mean"]),
        "bias": as_list(cell["bias"]),
        "rmse": as_list(cell["rmse"]),
        "variance": as_list(cell["variance"]),
        "lookups": [cell["lookups_per_sample"]],
        "ns_per_sample": [timing.get("ns_per_sample")],
    }


def shown_number(text):
    return None if text in ("null", "undefined") else float(text)


def same(shown, expected):
    """Full precision on both sides; a list of nothing may stand for as many unknown numbers."""
    known = [x for x in expected if x is not None]
    if not known:
        return all(x is None for x in shown)
    return shown == expected
