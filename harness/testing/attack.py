"""attack.py NULLMARK   attacks the program with damaged files, hostile names and strange paths, and counts the outcomes.

Every attempt has a seed of its own, so a failure can be run again: attack.py NULLMARK --only 117.  What may not happen: a process
that takes longer than its limit, one that a signal ends, an exit code that is not documented, bad input that is not told in one line,
control characters on a terminal, and a file that is not an output and changes.
"""
import argparse, collections, concurrent.futures, hashlib, json, os, pathlib, random, shutil, signal, subprocess, sys, tempfile

LIMIT = 60  # seconds; the longest takes one or two on an idle machine
CODES = {0, 2, 3, 4, 5, 77}
COMMANDS = ["check {r}", "compare {r}", "report {r} -o page.html", "export {r} --format csv", "export {r} --format jsonl",
            "merge {r} -o merged.json", "replay {r} {cell}", "gate --baseline {r} {r}", "check {r} --junit j.xml --markdown m.md"]
STRINGS = ["\x1b]0;owned\x07", "\x1b[2J\x1b[1;1H", "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "a|b|c", "```\n# x",
           "\ufffe\uffff", "\u0000", "\u0085\u009b31m", "../../../../etc/passwd", "${HOME}", "%s%n%x", "{0}{}", "'; touch owned; '",
           "`touch owned`", "", " ", "a" * 5000, "\u202etxt.exe", "\r\nnullmark: all is well"]
NUMBERS = [0, -1, 1, 2 ** 31, 2 ** 53 + 1, 2 ** 63, 2 ** 64, 1e15, 1e308, -1e308, 5e-324, 1e-320, 0.1, 1.5]
VALUES = STRINGS + NUMBERS + [None, True, False, [], {}, [[]], [None], {"type": "vdb", "file": "x.vdb"}, {"type": "library", "file": "x"},
                              {"type": "process", "command": ["touch", "owned"]}]
CONFIG = {"nullmark": "config/2", "name": "attack", "timing": {"enabled": False},
          "experiments": [{"name": "e", "rays": {"type": "orthographic", "width": 2, "height": 2}, "samples_per_ray": 64,
                           "verdict": {"max_samples_per_ray": 256, "max_lookups_per_ray": 4096},
                           "matrix": {"estimator": ["ratio", {"type": "residual_ratio", "control": "average"}],
                                      "medium": [{"type": "linear", "optical_depth": 1}, "homogeneous"],
                                      "majorant": ["global", {"type": "grid", "resolution": 4}]}}]}


def leaves(node, path=()):
    """The paths of all values below a JSON value."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield path + (key,)
        yield from leaves(value, path + (key,))


def replaced(document, path, value):
    """A copy of a document in which the value at a path is another."""
    copy = json.loads(json.dumps(document))
    node = copy
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    return copy


def damaged(text, rng):
    """Bytes of a text that was cut, flipped, doubled, or ends in garbage behind a zero."""
    data = bytearray(text.encode())
    kind = rng.randrange(6)
    at = rng.randrange(len(data))
    if kind == 0:
        return bytes(data[:at])
    if kind == 1:
        for _ in range(rng.randrange(1, 8)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(data)
    if kind == 2:
        return bytes(data) + b"\0" + rng.randbytes(64)
    if kind == 3:
        data[at:at] = rng.choice([b"\0", b"\xff\xfe", b"\xc3", b"1e999", b"[" * 500, b'"' * 3, b"\x1b[31m"])
        return bytes(data)
    if kind == 4:
        return bytes(data) + bytes(data)
    end = min(len(data), at + rng.randrange(1, 200))
    return bytes(data[:at] + data[end:])


class Attempt:
    def __init__(self, number, program, results):
        self.number, self.program, self.results = number, program, results
        self.rng = random.Random(number)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nullmark_attack_"))
        self.keep = {}  # files that must stay as they are

    def write(self, name, content):
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
        return path

    def guard(self, name):
        self.keep[name] = hashlib.sha256((self.folder / name).read_bytes()).hexdigest()

    def command(self):
        """What is attacked, and the arguments."""
        kind = self.number % 6
        rng = self.rng
        if kind == 0:
            self.write("c.json", damaged(json.dumps(CONFIG), rng))
            return "damaged configuration", "run c.json -o r.json"
        if kind in (1, 2):
            path = rng.choice(list(leaves(CONFIG)))
            self.write("c.json", json.dumps(replaced(CONFIG, path, rng.choice(VALUES))))
            return "hostile value in a configuration", rng.choice(["run c.json -o r.json", "run c.json --dry-run", "problem c.json -o p"])
        document = json.loads(self.results)
        cell = document["cells"][0]["name"]
        arguments = rng.choice(COMMANDS).format(r="r.json", cell=cell)
        if kind == 3:
            self.write("r.json", damaged(self.results, rng))
            return "damaged results", arguments
        if kind == 4:
            path = rng.choice(list(leaves(document)))
            self.write("r.json", json.dumps(replaced(document, path, rng.choice(VALUES))))
            return "hostile value in results", arguments
        return self.strange_path(arguments)

    def strange_path(self, arguments):
        rng = self.rng
        self.write("c.json", json.dumps(CONFIG))
        self.write("victim", "precious")
        self.guard("victim")
        os.mkfifo(self.folder / "pipe")
        (self.folder / "folder").mkdir()
        os.symlink("loop", self.folder / "loop")
        os.symlink("victim", self.folder / "link")
        odd = rng.choice(["pipe", "folder", "loop", "/dev/zero", "/dev/full", "/dev/null", "absent/x.json", "victim", "\x1b[31m.json", "x" * 300])
        what = rng.randrange(5)
        if what == 0:
            # Only what never ends by itself may not be read on.
            source = odd if odd != "pipe" else "/dev/zero"
            return "strange input", ["run", source, "-o", "r.json"]
        if what == 1:
            return "strange output", ["run", "c.json", "-o", odd] + rng.choice([[], ["--resume"]])
        if what == 2:
            target = rng.choice(["victim", "pipe", "folder", "loop"])
            os.symlink(target, self.folder / "r.json.journal") if target != "pipe" else os.mkfifo(self.folder / "r.json.journal")
            return "strange journal", ["run", "c.json", "-o", "r.json"] + rng.choice([[], ["--force"], ["--resume"]])
        if what == 3:
            self.write("r.json", self.results)
            self.guard("r.json")
            # The output is the input.
            return "output over input", rng.choice([["report", "r.json", "-o", "r.json"], ["merge", "r.json", "-o", "r.json"],
                                                    ["check", "r.json", "--junit", "r.json"], ["export", "r.json", "--format", "csv", "-o", "r.json"]])
        options = rng.choice([["--shard", "0/0"], ["--shard", "9/2"], ["--filter", "("], ["--filter", "(" * 400], ["--threads", "-1"],
                              ["--threads", "x"], ["--seed", "1e9"], ["--time-budget", "-1"], ["--bogus"], ["--shard", "1/99999999999"],
                              ["--filter", "\x1b[31m"], ["--builds", "odd"], [], ["c.json"], ["--seed", "18446744073709551616"]])
        return "strange option", ["run", "c.json", "-o", "r.json"] + options

    def run(self):
        """(class, outcome, fault or None)"""
        what, arguments = self.command()
        if isinstance(arguments, str):
            arguments = arguments.split(" ")
        environment = {key: value for key, value in os.environ.items() if not key.startswith("NULLMARK_")}
        try:
            with open(self.folder / "out", "wb") as out, open(self.folder / "err", "wb") as err:
                process = subprocess.run([self.program] + arguments, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                         timeout=LIMIT, env=environment)
            fault = self.fault(process.returncode, arguments)
            outcome = f"exit {process.returncode}"
        except subprocess.TimeoutExpired:
            outcome, fault = "hang", f"no end within {LIMIT} s"
        if fault:
            fault = f"attempt {self.number} ({what}): {fault}: {' '.join(arguments)[:200]!r}\n    {self.read('err')[:300]!r}"
        else:
            shutil.rmtree(self.folder, ignore_errors=True)
        return what, outcome, fault

    def read(self, name):
        return (self.folder / name).read_bytes().decode("utf-8", "replace")

    def fault(self, code, arguments):
        err, out = self.read("err"), self.read("out")
        if code < 0:
            return f"ended by {signal.Signals(-code).name}"
        if code not in CODES:
            return f"exit {code}"
        # Commands that hand on data, not text for people, keep it as it is.
        data = arguments[0] == "export" or "-" in arguments
        for text in [err] if data else [err, out]:
            if any((ord(c) < 32 and c not in "\n\t") or 127 <= ord(c) < 160 for c in text):
                return "control characters on the terminal"
        if code == 2:
            lines = [line for line in err.splitlines() if line.startswith("nullmark: ") and "warning" not in line]
            if len(lines) != 1:
                return f"{len(lines)} lines instead of one"
        for name, content in self.keep.items():
            if hashlib.sha256((self.folder / name).read_bytes()).hexdigest() != content:
                return f"changed {name}"
        if (self.folder / "owned").exists():
            return "ran a command of the input"
        if (self.folder / "m.md").exists() and ("<script" in self.read("m.md") or "<img" in self.read("m.md")):
            return "HTML of the input in m.md"
        return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--attempts", type=int, default=600)
    parser.add_argument("--only", type=int)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "c.json").write_text(json.dumps(CONFIG))
        subprocess.run([options.program, "run", "c.json", "-o", "r.json"], cwd=folder, check=True, capture_output=True)
        results = (pathlib.Path(folder) / "r.json").read_text()
    numbers = [options.only] if options.only is not None else range(options.attempts)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        outcomes = list(pool.map(lambda n: Attempt(n, options.program, results).run(), numbers))
    table = collections.Counter((what, outcome) for what, outcome, _ in outcomes)
    for (what, outcome), count in sorted(table.items()):
        print(f"{count:4d}  {what}: {outcome}")
    faults = [fault for _, _, fault in outcomes if fault]
    print("\n".join(faults))
    print(f"{len(outcomes)} attempts, {len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
