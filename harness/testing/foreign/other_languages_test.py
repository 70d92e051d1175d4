#!/usr/bin/python3
"""Trackers in Rust and numpy against the program: other_languages_test.py PROGRAM.  What is not installed is skipped, and said."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(REPOSITORY / "harness" / "python"))
os.environ["NULLMARK_PROGRAM"] = sys.argv.pop(1)

import nullmark  # noqa: E402

MEDIA = [{"type": "linear", "begin": 0.5, "end": 2}, {"type": "linear", "spectrum": [1, 2, 0.5]}]
BOUNDS = ["global", {"type": "grid", "resolution": 4}]

TRACKERS = '''
import numpy as np
import nullmark


def walk(samples, slip, step):
    weight, alive = samples.ones(), samples.all()
    while alive.size:
        if step:
            alive, t, rate, extinction = samples.step(alive)
        else:
            alive, t, rate = samples.next(alive)
            extinction = samples.lookup(alive, t)
        weight[alive] *= 1 - slip * extinction / rate[:, None]
    return weight


@nullmark.tracker(range="unit")
def ratio(ray, samples, slip=1.0, step=True):
    return walk(samples, slip, step)


@nullmark.tracker(range="binary", needs_bound=True, quantities=("transmittance", "free_path"))
def delta(ray, samples):
    distance = np.full(samples.count, ray.end)
    alive = samples.all()
    while alive.size:
        alive, t, rate = samples.next(alive)
        collided = samples.uniform(alive) * rate < samples.lookup(alive, t)[:, 0]
        distance[alive[collided]] = t[collided]
        alive = alive[~collided]
    inside = distance < ray.end
    if samples.quantity == "free_path":
        return distance, np.where(inside, 3, 0), samples.ones()
    return 1.0 - inside


@nullmark.tracker(range="unit", theory=lambda ray, quantity, channel: [float("nan"), 0.25 * np.exp(-2.0), 2, 2])
def wrong_theory(ray, samples):
    return walk(samples, 1, True)


@nullmark.tracker
def fails(ray, samples):
    return samples.lookup(samples.all(), ray.begin) + undefined_name


@nullmark.tracker
def shape(ray, samples):
    return np.ones(3)


@nullmark.tracker(own_medium=True, streams="free", range="binary")
def renderer(ray, samples):
    alive = np.random.default_rng().random(samples.count) < np.exp(-(ray.end - ray.begin))
    return alive * 1.0, np.full(samples.count, 7)


verdict = nullmark.judge(ratio)  # not reached in the tracker's own process
raise RuntimeError("the file went on past judge")
'''


def words(verdict):
    return {record["word"] for record in verdict.records}


class Trackers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp())
        (cls.folder / "mine.py").write_text(TRACKERS)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def tracker(self, name, **parameters):
        command = ["/usr/bin/python3", "-m", "nullmark", "serve", str(self.folder / "mine.py"), name]
        return {"type": "process", "command": command, "parameters": parameters}

    def judge(self, *trackers, **options):
        options = {"media": MEDIA, "majorants": BOUNDS, "timing": False, **options}
        return nullmark.judge(*trackers, **options)

    def test_a_right_tracker_passes_and_a_slip_fails(self):
        right = self.judge(self.tracker("ratio"), self.tracker("ratio", step=False))
        self.assertEqual({word.split()[0] for word in words(right)}, {"PASS"}, right)
        wrong = self.judge(self.tracker("ratio", slip=1.01), samples=1 << 17)
        self.assertTrue(all(word.startswith("FAIL") for word in words(wrong)), wrong)
        self.assertEqual(wrong.exit_code, 3)

    def test_free_paths_and_binary_samples(self):
        grey = MEDIA[:1]
        self.assertEqual({w.split()[0] for w in words(self.judge(self.tracker("delta"), media=grey))}, {"PASS"})
        self.assertEqual({w.split()[0] for w in words(self.judge(self.tracker("delta"), media=grey, quantity="free_path"))}, {"PASS"})

    def test_a_wrong_theory_is_found(self):
        constant = {"type": "homogeneous", "extinction": 1}
        verdict = self.judge(self.tracker("wrong_theory"), media=constant, majorants={"type": "global", "looseness": 2})
        self.assertEqual(verdict.exit_code, 3, verdict)

    def test_an_exception_names_the_cell_and_the_last_frame(self):
        verdict = self.judge(self.tracker("fails"), self.tracker("shape"), media=MEDIA[:1], majorants="global")
        self.assertEqual(verdict.exit_code, 1)
        reasons = [record["reason"] for record in verdict.records]
        self.assertIn("NameError: name 'undefined_name' is not defined (mine.py:", reasons[0])
        self.assertIn(", fails)", reasons[0])
        self.assertIn("ValueError: the result has shape (3,); expected (", reasons[1])

    def test_a_renderer_with_its_own_medium_is_marked(self):
        verdict = self.judge(self.tracker("renderer"), media={"type": "homogeneous", "extinction": 1}, majorants="global")
        (record,) = verdict.records
        self.assertTrue(record["word"].startswith("PASS"), verdict)
        self.assertTrue(record["estimator"]["lookups_told"])
        self.assertEqual(record["lookups_per_sample"], 7)
        self.assertTrue(any("cannot be drawn again" in text for text in record["verdict"]["untested"]))

    def test_the_shipped_example(self):
        path = REPOSITORY / "harness" / "python" / "example" / "ratio.py"
        spec = importlib.util.spec_from_file_location("example", path)
        example = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(example)
        verdict = nullmark.judge(example.ratio_in_numpy, "ratio", media=["cosine", "linear"])
        self.assertTrue(verdict.passed, verdict)
        self.assertIn("4 PASS", str(verdict))

    @unittest.skipUnless(importlib.util.find_spec("pandas"), "no pandas")
    def test_frames_and_plots(self):
        kept = self.folder / "kept.json"
        verdict = self.judge(self.tracker("ratio"), "ratio", timing=True, output=str(kept))
        frame = nullmark.results(kept)
        self.assertEqual(len(frame), 2 * (1 + 3) * 2)
        self.assertEqual(set(frame["tracker"]), {"ratio"})
        self.assertTrue((frame["variance"] > 0).all())
        self.assertTrue({"medium.begin", "majorant.looseness", "estimator.command"} <= set(frame.columns), list(frame.columns))
        if importlib.util.find_spec("matplotlib"):
            import matplotlib

            matplotlib.use("Agg")
            verdict.plot().figure.savefig(self.folder / "plot.png")
            self.assertGreater((self.folder / "plot.png").stat().st_size, 1000)

    @unittest.skipUnless(shutil.which("rustc"), "no rustc")
    def test_rust(self):
        source = REPOSITORY / "harness" / "foreign" / "example" / "ratio.rs"
        for cfg, code in (([], 0), (["--cfg", "slip"], 3)):
            library = self.folder / f"lib{code}.so"
            subprocess.run(["rustc", "--crate-type", "cdylib", "-O", *cfg, "-o", library, source], check=True, capture_output=True)
            verdict = self.judge({"type": "library", "file": str(library)}, samples=1 << 17)
            self.assertEqual(verdict.exit_code, code, verdict)
            if code == 0:
                built_in = self.judge("ratio", samples=1 << 17)
                self.assertEqual([r["mean"] for r in verdict.records], [r["mean"] for r in built_in.records])

    def test_a_refusal_is_the_programs_line(self):
        with self.assertRaisesRegex(Exception, 'unknown estimator "ratoi"; did you mean "ratio"'):
            self.judge("ratoi")

    @unittest.skipUnless(importlib.util.find_spec("pip") and importlib.util.find_spec("wheel"), "no pip with wheel")
    def test_the_wheel_works(self):
        source = self.folder / "source"
        shutil.copytree(REPOSITORY / "harness" / "python", source)
        pip = ["/usr/bin/python3", "-m", "pip"]
        quiet = {"check": True, "capture_output": True}
        subprocess.run([*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", self.folder, source], **quiet)
        (wheel,) = self.folder.glob("nullmark-*.whl")
        target = self.folder / "installed"
        subprocess.run([*pip, "install", "--no-deps", "--no-index", "--target", target, wheel], **quiet)
        done = subprocess.run(
            ["/usr/bin/python3", REPOSITORY / "harness/python/example/ratio.py"],
            capture_output=True, text=True, cwd=self.folder, env={**os.environ, "PYTHONPATH": str(target)},
        )
        self.assertIn("4 PASS", done.stdout, done.stderr)


if __name__ == "__main__":
    unittest.main()
