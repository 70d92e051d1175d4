"""Filters, sorting, and the keyboard."""

import re

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from .page import PLOTS, ROWS, PageTest
from .results import CELLS, shown_number
from .views import once_a_layout

VISIBLE_CONTROLS = """
  const all = document.querySelectorAll("a[href], button:not([disabled]), select, input, summary, [tabindex='0']");
  return [...all].filter((one) => one.checkVisibility() && one.getClientRects().length > 0);"""

# Where a key has led: whether it has been there or left the page, what it is, its outline.
STEP = """
  const one = document.activeElement, ended = one === document.body || reached.has(one);
  reached.add(one);
  return [ended, one.tagName, getComputedStyle(one).outlineStyle];"""


class ControlsTest(PageTest):
    @once_a_layout
    def test_40_filters_change_rows_and_plots(self):
        estimators = sorted({cell["estimator"] for cell in self.js("return report")["cells"]})
        if len(estimators) < 2:
            self.skipTest("one estimator")
        box = self.facet("estimator", "None")
        self.assertEqual(self.shown_rows(), {})
        self.assertEqual(self.js(PLOTS), [])
        self.check_one(box, estimators[0])
        rows = self.shown_rows()
        labels = self.js("return report.cells.map((cell) => cell.estimator)")
        self.assertEqual(sorted(rows), [i for i, label in enumerate(labels) if label == estimators[0]])
        for plot in self.draw_all():
            names = {re.sub(r": .*", "", name) for name in plot["names"]} - {"front", "slope −1/2", "slope −1"}
            for name in names:
                self.assertTrue(name.startswith(estimators[0]), f"{plot['text']}: {name}")
        self.facet("estimator", "All")
        self.assertEqual(len(self.shown_rows()), len(CELLS))
        self.detail = f"{len(rows)} of {len(CELLS)} rows with {estimators[0]} alone"

    @once_a_layout
    def test_41_filters_by_medium_and_quantity(self):
        for key in ["medium", "quantity"]:
            boxes = self.browser.find_elements(By.CSS_SELECTOR, f"[data-facet={key}]")
            if not boxes:
                continue
            of_cells = [cell["medium"]["label"] if key == "medium" else cell["quantity"] for cell in CELLS]
            hidden = of_cells[0]
            self.js("arguments[0].open = true", boxes[0])
            self.check_one(boxes[0], hidden)
            self.assertEqual(sorted(self.shown_rows()), [i for i, value in enumerate(of_cells) if value != hidden])
            self.facet(key, "All")

    @once_a_layout
    def test_42_words_and_verdicts_filter_the_table(self):
        search = self.find("#search")
        search.send_keys("no cell has such a name")
        self.assertEqual(self.js(ROWS), [])
        self.js("arguments[0].value = ''; arguments[0].dispatchEvent(new Event('input'))", search)
        choice = Select(self.find("#verdicts select"))
        total = 0
        for value in [option.get_attribute("value") for option in choice.options][1:]:
            choice.select_by_value(value)
            total += len(self.shown_rows())
        self.assertEqual(total, len(CELLS))
        choice.select_by_value("")

    @once_a_layout
    def test_43_headings_sort(self):
        heads = self.browser.find_elements(By.CSS_SELECTOR, "#verdicts th button")
        at = [head.text for head in heads].index("RMSE")
        for direction, order in [("ascending", 1), ("descending", -1)]:
            heads[at].send_keys(Keys.ENTER)
            self.assertEqual(self.js("return arguments[0].closest('th').ariaSort", heads[at]), direction)
            numbers = [shown_number(row[1]["rmse"][0]) for row in self.js(ROWS) if row[1].get("rmse")]
            known = [order * x for x in numbers if x is not None]
            self.assertEqual(known, sorted(known))
            self.assertEqual(numbers[len(known):], [None] * (len(numbers) - len(known)))

    @once_a_layout
    def test_50_tab_reaches_every_control(self):
        self.open("")
        controls = self.js(f"window.controls = [...(() => {{ {VISIBLE_CONTROLS} }})()]; window.reached = new Set(); return controls.length")
        unseen = []
        for _ in range(controls + 20):
            for kind in ["rawKeyDown", "keyUp"]:
                self.browser.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": "Tab", "code": "Tab", "windowsVirtualKeyCode": 9})
            ended, what, outline = self.js(STEP)
            if ended:
                break
            if outline == "none":
                unseen.append(what)
        missed = self.js("return controls.filter((one) => !reached.has(one)).map((one) => one.outerHTML.slice(0, 80))")
        self.assertEqual(missed, [])
        self.assertEqual(unseen, [])
        self.detail = f"{controls} controls"

    @once_a_layout
    def test_51_enter_and_space_work(self):
        self.find("#theme").send_keys(Keys.ENTER)
        self.assertNotEqual(self.js("return document.documentElement.dataset.theme"), self.theme)
        self.find("#theme").send_keys(Keys.SPACE)
        self.assertEqual(self.js("return document.documentElement.dataset.theme"), self.theme)
        self.find(".skip").send_keys(Keys.ENTER)
        self.assertEqual(self.js("return location.hash"), "#content")
        for summary in self.browser.find_elements(By.CSS_SELECTOR, ".facet summary, details.numbers summary")[:2]:
            summary.send_keys(Keys.ENTER)
            self.assertTrue(self.js("return arguments[0].parentElement.open", summary))
            summary.send_keys(Keys.ENTER)
