#!/usr/bin/env python3
"""Opens a report's page in Chromium and compares what it shows with the results it was made of.

browser_test.py PAGE.html RESULTS.json...      exit 0: all is shown, 1: something is not, 77: no browser to look with
"""

import importlib.util
import shutil
import sys


def main(arguments):
    if len(arguments) < 2:
        print(__doc__.strip())
        return 2
    if not importlib.util.find_spec("selenium") or not shutil.which("chromium") or not shutil.which("chromedriver"):
        print("skipped: needs the Debian packages python3-selenium chromium chromium-driver")
        return 77
    from browser.run import run  # not before: it needs selenium

    return 0 if run(arguments[0], arguments[1:]) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
