"""All tests of a page, and a line for each."""

import pathlib
import time
import unittest

from .contents import ContentsTest
from .controls import ControlsTest
from .looks import LooksTest
from .page import SECONDS_TO_A_FRAME, NoFrames
from .paper import PaperTest
from .plots import PlotsTest
from .results import read_results
from .views import views

RESTARTS = 3


class OneLineEach(unittest.TestResult):
    passed = failed = 0

    def __init__(self):
        super().__init__()
        self.stalled = []  # tests whose browser stopped drawing

    def line(self, word, test, detail=""):
        width, height = test.size
        what = test._testMethodName[8:].replace("_", " ")
        print(f"{word:5} {width}x{height} {test.theme:5}  {what}{': ' + detail if detail else ''}", flush=True)

    def startTest(self, test):
        super().startTest(test)
        self.began = time.monotonic()
        self.found_before = len(self.failures) + len(self.errors)

    def addError(self, test, err):
        if err[0] is NoFrames and hasattr(test, "_testMethodName"):
            if test not in self.stalled:
                self.stalled.append(test)
        else:
            super().addError(test, err)

    def stopTest(self, test):
        super().stopTest(test)
        if any(test is one for one, _ in self.skipped):
            return
        if test in self.stalled:
            for found in (self.failures, self.errors):
                found[:] = [one for one in found if one[0] is not test]
            self.line("again", test, f"the browser drew no frame in {SECONDS_TO_A_FRAME} s; a new one is to show it")
        elif len(self.failures) + len(self.errors) > self.found_before:
            self.failed += 1
            self.line("FAIL", test)
            for _, trace in (self.failures + self.errors)[self.found_before:]:
                print("      " + "\n      ".join(trace.strip().splitlines()[-6:]), flush=True)
        else:
            self.passed += 1
            took = time.monotonic() - self.began
            self.line("ok", test, ", ".join(filter(None, [getattr(test, "detail", ""), f"{took:.0f} s" if took > 5 else ""])))

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self.line("skip", test, reason)


def suite(page):
    tests = unittest.TestSuite()
    for size, theme in views():
        name = f"Page{size[0]}x{size[1]}{theme}"
        case = type(name, (LooksTest, ContentsTest, PlotsTest, ControlsTest, PaperTest), {"page": page, "size": size, "theme": theme})
        for test in unittest.defaultTestLoader.getTestCaseNames(case):
            if getattr(getattr(case, test), "wanted", lambda view: True)((size, theme)):
                tests.addTest(case(test))
    return tests


def run(page, results):
    """Whether the page shows what the results hold."""
    read_results(results)
    began = time.monotonic()
    passed = failed = skipped = 0
    tests = suite(pathlib.Path(page).resolve())
    for _ in range(1 + RESTARTS):
        result = OneLineEach()
        tests.run(result)
        passed += result.passed
        failed += result.failed
        skipped += len(result.skipped)
        for test, trace in result.errors:
            if not hasattr(test, "_testMethodName"):  # a browser that did not start
                print(f"FAIL  {test}\n{trace}")
                failed += 1
        tests = unittest.TestSuite(result.stalled)
    for test in result.stalled:
        result.line("FAIL", test, "no browser draws it")
        failed += 1
    print(f"{time.monotonic() - began:.0f} s")
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return failed == 0 and passed > 0
