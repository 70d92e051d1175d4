"""A page in a browser, and what all of its tests read of it."""

import json
import re
import shutil
import time
import unittest

from selenium import webdriver
from selenium.common.exceptions import WebDriverException
from selenium.webdriver.common.by import By

from .views import SIZES, THEMES

PATIENCE = 120
SECONDS_TO_A_FRAME = 5

# Of every plot: where it is, its kinds of traces, how many finite points, and the names in its legend.
PLOTS = """
  return [...document.querySelectorAll(".graph")].map((plot) => ({
    section: plot.closest("section").id,
    drawn: Array.isArray(plot.data),
    names: (plot.data ?? []).filter((trace) => trace.showlegend !== false && trace.name).map((trace) => trace.name),
    traces: (plot.data ?? []).map((trace) => {
      const numbers = trace.type === "heatmap" ? trace.z.flatMap((row) => [...row]) : [...trace.x, ...trace.y];
      return { type: trace.type, finite: numbers.filter(Number.isFinite).length, of: numbers.length };
    }),
    marks: plot.querySelectorAll("path.point, path.js-line, image").length,
    text: plot.getAttribute("aria-label"),
  }));"""

ROWS = """
  return [...document.querySelectorAll("#verdicts tbody tr")].map((row) => {
    const numbers = {};
    for (const one of row.querySelectorAll("[data-key]")) (numbers[one.dataset.key] ??= []).push(one.dataset.value);
    return [Number(row.dataset.cell), numbers];
  });"""


class NoFrames(Exception):
    """The browser has stopped drawing: whatever the page asks for is never shown."""


def open_browser():
    options = webdriver.ChromeOptions()
    for flag in ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    options.binary_location = shutil.which("chromium") or ""
    service = webdriver.chrome.service.Service(shutil.which("chromedriver"))
    return webdriver.Chrome(options=options, service=service)


class PageTest(unittest.TestCase):
    """One window size and one theme; the tests share a browser and leave the page as they found it."""

    page, size, theme = None, SIZES[0], THEMES[0]

    @classmethod
    def setUpClass(cls):
        cls.messages, cls.requests = [], []
        cls.start()

    @classmethod
    def start(cls):
        cls.browser = open_browser()
        cls.browser.execute_cdp_cmd("Network.enable", {})
        width, height = cls.size
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        cls.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        cls.prefer(cls.theme)
        cls.open("")

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()

    @classmethod
    def prefer(cls, theme, media=""):
        features = [{"name": "prefers-color-scheme", "value": theme}]
        cls.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})

    @classmethod
    def open(cls, rest, ready="page"):
        cls.browser.get("about:blank")
        cls.browser.get(cls.page.as_uri() + rest)
        cls.wait(lambda: cls.js("return document.documentElement.dataset.ready") == ready)

    @classmethod
    def wait(cls, condition):
        began = asked = time.monotonic()
        while not condition():
            time.sleep(0.01)
            now = time.monotonic()
            if now - began > PATIENCE:
                raise TimeoutError(f"not met in {PATIENCE} s")
            if now - asked > SECONDS_TO_A_FRAME:
                cls.expect_frames()
                asked = time.monotonic()

    @classmethod
    def expect_frames(cls):
        """Throws NoFrames, with a new browser in place, where this one has stopped drawing."""
        began = time.monotonic()
        try:
            cls.js("window.hasDrawn = false; requestAnimationFrame(() => { window.hasDrawn = true; })")
            while time.monotonic() - began < SECONDS_TO_A_FRAME:
                if cls.js("return window.hasDrawn"):
                    return
                time.sleep(0.01)
        except WebDriverException:
            pass
        cls.browser.quit()
        cls.start()
        raise NoFrames

    @classmethod
    def js(cls, code, *arguments):
        return cls.browser.execute_script(code, *arguments)

    def tearDown(self):
        self.expect_frames()
        self.messages += [entry["message"] for entry in self.browser.get_log("browser")]
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.requests.append(message["params"]["request"]["url"])

    def find(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def shown_rows(self):
        """Of all pages of the table of cells."""
        rows = dict(self.js(ROWS))
        turned = 0
        while self.js("return !document.querySelectorAll('#verdicts p button')[1].disabled"):
            self.js("document.querySelectorAll('#verdicts p button')[1].click()")
            rows.update(self.js(ROWS))
            turned += 1
        for _ in range(turned):
            self.js("document.querySelectorAll('#verdicts p button')[0].click()")
        return rows

    def draw_all(self):
        """By scrolling each plot into view, as a reader would."""
        for plot in self.browser.find_elements(By.CSS_SELECTOR, ".graph"):
            self.draw(plot)
        return self.js(PLOTS)

    def draw(self, plot):
        """By scrolling it into view, again where plots above it grow and push it away before it is seen."""
        self.wait(lambda: self.js("arguments[0].scrollIntoView(); return Array.isArray(arguments[0].data) && arguments[0].data.length > 0", plot))

    def facet(self, key, which):
        box = self.find(f"[data-facet={key}]")
        self.js("arguments[0].open = true", box)
        box.find_element(By.XPATH, f".//button[text()='{which}']").click()
        return box

    def check_one(self, box, value):
        for check in box.find_elements(By.CSS_SELECTOR, "input"):
            if check.get_attribute("value") == value:
                self.js("arguments[0].click()", check)
                return
        self.fail(f"no checkbox for {value}")

    # 9: what all that left behind

    def test_90_the_console_is_empty(self):
        self.tearDown()
        self.assertEqual(self.messages, [])

    def test_91_no_request_left_the_page(self):
        self.tearDown()
        self.assertGreater(len(self.requests), 0)
        self.assertEqual([url[:100] for url in self.requests if not re.match(r"(file|data|blob|about|chrome):", url)], [])
