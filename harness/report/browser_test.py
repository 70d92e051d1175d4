#!/usr/bin/env python3
"""Opens a report's page in Chromium and compares what it shows with the results it was made of.

browser_test.py PAGE.html RESULTS.json...      exit 0: all is shown, 1: something is not, 77: no browser to look with
"""

import base64
import json
import pathlib
import re
import shutil
import sys
import time
import unittest

try:
    from selenium import webdriver
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import Select, WebDriverWait
except ImportError:
    webdriver = None

SIZES = [(1366, 768), (1920, 1080), (390, 844)]
THEMES = ["light", "dark"]
SECONDS_TO_OPEN = 10  # a bound for loaded machines; what it took is printed
PATIENCE = 120
MANY_CELLS = 200

PAGE = None
CELLS = []  # of all results, in the order of the page
TABLES = []  # (table, cells of its run by name)
VERSIONS = []  # of the programs that measured


def timed():
    return any(cell.get("time") for cell in CELLS)


def as_list(value):
    return value if isinstance(value, list) else [value]


def read_results(files):
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


def contrast(one, other):
    def luminance(colour):
        channels = [int(c) / 255 for c in re.findall(r"\d+", colour)[:3]]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted([luminance(one), luminance(other)], reverse=True)
    return (light + 0.05) / (dark + 0.05)


def open_browser():
    options = webdriver.ChromeOptions()
    for flag in ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    options.binary_location = shutil.which("chromium") or ""
    service = webdriver.chrome.service.Service(shutil.which("chromedriver"))
    return webdriver.Chrome(options=options, service=service)


def once(test):
    """What the page says and knows is the same at every size and in every theme."""
    test.wanted = lambda view: view == views()[0]
    return test


def once_a_layout(test):
    """What hands do depends on where things stand, not on their colours."""
    test.wanted = lambda view: view[1] == THEMES[0]
    return test


def has_two_costs(cell):
    """Of a cell of the page's data: a time and a variance that is more than rounding."""
    cost, timing = cell["cost"], cell["time"]
    return bool(cost and timing and timing["ns_per_sample"] and cost["variance"]["value"] > (1e-10 * cost["reference"]) ** 2)


VISIBLE_CONTROLS = """
  const all = document.querySelectorAll("a[href], button:not([disabled]), select, input, summary, [tabindex='0']");
  return [...all].filter((one) => one.checkVisibility() && one.getClientRects().length > 0);"""

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


class PageTest(unittest.TestCase):
    """One window size and one theme; the tests share a browser and leave the page as they found it."""

    size, theme = SIZES[0], THEMES[0]

    @classmethod
    def setUpClass(cls):
        cls.browser = open_browser()
        cls.browser.execute_cdp_cmd("Network.enable", {})
        cls.messages, cls.requests = [], []
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
        cls.browser.get(PAGE.as_uri() + rest)
        cls.wait(lambda: cls.js("return document.documentElement.dataset.ready") == ready)

    @classmethod
    def wait(cls, condition):
        WebDriverWait(cls.browser, PATIENCE, 0.05).until(lambda _: condition())

    @classmethod
    def js(cls, code, *arguments):
        return cls.browser.execute_script(code, *arguments)

    def tearDown(self):
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
            self.js("arguments[0].scrollIntoView()", plot)
            self.wait(lambda: self.js("return Array.isArray(arguments[0].data)", plot))
        return self.js(PLOTS)

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

    # 1: the page is there

    def test_10_opens_in_time(self):
        took = self.js("const [at] = performance.getEntriesByType('navigation'); return at.loadEventEnd / 1000")
        paint = self.js("return performance.getEntriesByName('first-contentful-paint').map((e) => e.startTime / 1000)[0] ?? null")
        self.detail = f"{len(CELLS)} cells, first paint {paint and round(paint, 2)} s, loaded {took:.2f} s"
        self.assertLess(took, SECONDS_TO_OPEN)

    def test_11_fits_the_window(self):
        self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), self.size[0])

    def test_12_follows_the_theme(self):
        self.assertEqual(self.js("return document.documentElement.dataset.theme"), self.theme)
        colours = self.js("""const of = (selector) => getComputedStyle(document.querySelector(selector));
            return [of(":root").backgroundColor, of(":root").color, of(".says").color, of("#contents a").color]""")
        dark = contrast(colours[0], "rgb(0,0,0)") < contrast(colours[0], "rgb(255,255,255)")
        self.assertEqual(dark, self.theme == "dark")
        for colour in colours[1:]:
            self.assertGreaterEqual(contrast(colours[0], colour), 4.5)

    def test_13_a_button_changes_the_theme_of_page_and_plots(self):
        plots = self.draw_all()
        read = "return document.querySelector('.graph')?._fullLayout.font.color"
        before = self.js(read)
        self.find("#theme").click()
        self.assertNotEqual(self.js("return document.documentElement.dataset.theme"), self.theme)
        if plots:
            self.assertNotEqual(self.js(read), before)
        self.find("#theme").click()
        self.assertEqual(self.js(read), before)

    def test_14_a_hash_leads_to_its_section(self):
        for section in self.js("return [...document.querySelectorAll('main > section')].map((one) => one.id)"):
            link = self.find(f"#contents a[href='#{section}']")
            self.js("arguments[0].click()", link)
            self.assertEqual(self.js("return location.hash"), f"#{section}")
        self.open("#verdicts")
        top = self.js("return document.getElementById('verdicts').getBoundingClientRect().top")
        self.assertLess(abs(top), self.size[1])
        self.open("")

    # 2: the numbers are those of the results

    @once
    def test_20_every_number_is_that_of_the_results(self):
        rows = self.shown_rows()
        self.assertEqual(len(rows), len(CELLS))
        compared = 0
        for index, cell in enumerate(CELLS):
            if cell["status"] != "ok":
                continue
            for key, expected in numbers_of(cell).items():
                shown = [shown_number(text) for text in rows[index].get(key, [])]
                self.assertTrue(same(shown, expected), f"{cell['name']}: {key} {shown}, expected {expected}")
                compared += len(shown)
        self.detail = f"{compared} numbers of {len(CELLS)} cells"

    @once
    def test_21_tables_show_the_numbers_of_the_results(self):
        self.assertEqual(len(self.browser.find_elements(By.CSS_SELECTOR, "#tables table.comparison")), len(TABLES))
        compared = 0
        for index, (table, cells) in enumerate(TABLES):
            heads = self.js(f"""return [...document.querySelectorAll("[data-table='{index}'] thead th.numeric")].map((th) => th.textContent)""")
            for at, row in enumerate(table["rows"]):
                shown = self.js(f"""return [...document.querySelectorAll("[data-table='{index}'] [data-row='{at}'] [data-key=table]")].map((one) => one.dataset.value)""")
                by_heading = dict(zip(heads, map(shown_number, shown)))
                for heading, number in self.expected_of_row(table, row, cells).items():
                    self.assertEqual(by_heading.get(heading), number, f"{table['title']}: {row['label']}, {heading}")
                    compared += 1
        self.detail = f"{compared} numbers of {len(TABLES)} tables"

    @staticmethod
    def expected_of_row(table, row, cells):
        metric = {"lookups": "lookups_per_sample"}.get(table["metric"], table["metric"])
        expected = dict(row.get("given", {}))
        if "relative_to" in row:
            return expected
        asked = [(heading, one, metric) for heading, one in row.get("cells", {}).items()]
        if "theory" in row:
            asked.append(("theory", row["theory"], metric + "_theory"))
        for heading, one, key in asked:
            number = cells.get(one.get("cell"), {}).get(key)
            if isinstance(number, (int, float)):
                expected[heading] = number
        return expected

    @once
    def test_22_tables_show_the_pictures_of_their_cells(self):
        if not self.js("return Object.values(JSON.parse(document.getElementById('data').textContent).images).length"):
            self.skipTest("the results have no pictures")
        if not TABLES:
            self.skipTest("the results have no tables")
        shades = self.js("""return [...document.querySelectorAll("#tables canvas")].map((canvas) =>
            new Set(new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size)""")
        self.assertGreater(len(shades), 0)
        self.assertGreater(max(shades), 16)
        self.assertGreater(min(shades), 0)

    @once
    def test_23_says_which_versions_measured_and_show(self):
        about = self.find("#summary .about").text
        for version in VERSIONS:
            self.assertIn(f"Measured by {version}; page by ", about)
        lines = self.js("report.runs[0].remarks.push('a remark'); return remarkLines().map((line) => line.textContent)")
        self.js("report.runs[0].remarks.pop()")
        self.assertIn("a remark", lines[-2 if not timed() else -1])

    @once
    def test_24_columns_of_time_are_there_where_something_was_timed(self):
        heads = self.js("return [...document.querySelectorAll('#ranking th, #verdicts th')].map((th) => th.textContent)")
        self.assertEqual(any("seconds" in head or head == "ns a sample" for head in heads), timed())
        said = self.js("return [...document.querySelectorAll('#summary .remark')].some((one) => one.textContent.startsWith('Nothing was timed'))")
        self.assertEqual(said, not timed())

    @once_a_layout
    def test_25_badges_explain_and_lead_to_their_cells(self):
        badges = self.browser.find_elements(By.CSS_SELECTOR, "#summary .totals .badge")
        choice = Select(self.find("#verdicts select"))
        outcomes = [option.get_attribute("value") for option in choice.options]
        for badge in badges:
            self.assertGreater(len(badge.get_attribute("title")), 20)
            word = re.sub(r"^\W*\d+ ", "", badge.text)
            self.js("arguments[0].click()", badge)
            self.assertEqual(choice.first_selected_option.get_attribute("value"), word if word in outcomes else "")
        choice.select_by_value("")
        titles = self.js("return [...document.querySelectorAll('#verdicts .badge.violated')].map((one) => one.title)")
        for title in titles:
            self.assertRegex(title, r"lookups above the bound, the largest")

    @once
    def test_26_names_begin_with_their_experiments(self):
        several = len({cell["experiment"] for cell in CELLS}) > 1
        names = self.js("return report.scenes.map((scene) => [scene.short, scene.experiment])")
        self.assertTrue(all(short.startswith(experiment + ": ") == several for short, experiment in names))

    @once
    def test_27_numbers_are_written_one_way(self):
        self.assertEqual(self.js("return [withPageNumbers('T = .95: bias -.133, e.g. 1.5, a-3'), formatPercent(.22)]"),
                         ["T = 0.95: bias −0.133, e.g. 1.5, a-3", "22\u00a0%"])
        text = self.js("return document.getElementById('content').textContent")
        self.assertNotRegex(text, r"to \.?\d+ %")

    # 3: the plots have data

    @once
    def test_28_claims_show_their_verdicts(self):
        claims = self.js("return JSON.parse(document.getElementById('data').textContent).claims")
        if not claims:
            self.skipTest("the results have no claims")
        rows = self.browser.find_elements(By.CSS_SELECTOR, "#claims tbody tr")
        self.assertEqual(len(rows), len(claims))
        for row, claim in zip(rows, claims):
            text = row.text
            for expected in [claim["id"], claim["finding"], claim["claim"], claim["source"]] + [part["figures"] for part in claim["parts"]]:
                self.assertIn(expected, text)
        self.detail = f"{len(claims)} claims"

    def test_30_every_plot_has_data(self):
        plots = self.draw_all()
        for plot in plots:
            with self.subTest(plot=plot["text"]):
                self.assertTrue(plot["traces"])
                self.assertGreater(plot["marks"], 0)
                self.assertGreater(len(plot["text"]), 20)
                self.assertTrue(any(trace["finite"] > 0 for trace in plot["traces"]))
                for trace in plot["traces"]:
                    # A picture of zeros has nothing on a logarithmic scale.
                    if trace["type"] != "heatmap":
                        self.assertEqual(trace["finite"], trace["of"])
                        self.assertGreater(trace["finite"], 0)
        self.detail = f"{len(plots)} plots, {sum(len(plot['traces']) for plot in plots)} traces"

    @once
    def test_31_no_plot_is_missing(self):
        plots = self.js(PLOTS)
        count = {section: sum(plot["section"] == section for plot in plots) for section in {plot["section"] for plot in plots}}
        data = json.loads(self.js("return document.getElementById('data').textContent"))

        def scenes(has):
            return sum(any(has(data["cells"][entry["cell"]]) for entry in scene["ranking"]) for scene in data["scenes"])

        def one_or_few(number):
            return number if number <= 4 else 1

        timed = scenes(lambda cell: any((step["seconds"] or {}).get("value") and step["rmse"]["value"] for step in cell["convergence"]))
        untimed = scenes(lambda cell: any(step["lookups"] and step["rmse"]["value"] for step in cell["convergence"]))
        self.assertEqual(count.get("error", 0), one_or_few(timed or untimed))
        self.assertEqual(count.get("pareto", 0), one_or_few(scenes(has_two_costs)))
        costs = any(cell["cost"] and cell["cost"]["variance_x_lookups"] for cell in data["cells"])
        self.assertEqual(count.get("matrix", 0), int(costs))

        def swept(cost):
            return {(series["axis"], series["rest"]) for series in data["scaling"] if any(point[cost] for point in series["points"])}

        self.assertEqual(count.get("scaling", 0), len(swept("ns_per_sample") or swept("lookups")))
        pictured = scenes(lambda cell: cell["images"])
        cells = sum(cell["images"] is not None for cell in data["cells"])
        for section in ["maps", "strips"]:
            if pictured <= 4:
                self.assertEqual(count.get(section, 0), cells)
            else:
                self.assertGreater(count.get(section, 0), 0)
        for cell, result in zip(data["cells"], CELLS):
            self.assertEqual(cell["images"] is None, "layers" not in (result.get("images") or {}), result["name"])

    @once
    def test_33_logarithmic_axes_have_two_labels(self):
        self.draw_all()
        labels = self.js("""return [...document.querySelectorAll(".graph")].flatMap((plot) =>
            ["xaxis", "yaxis"].map((key) => plot._fullLayout[key]).filter((axis) => axis?.type === "log")
                .map((axis) => [plot.getAttribute("aria-label"), axis._vals.filter(({ text }) => text).length]))""")
        self.assertEqual([label for label in labels if label[1] < 2], [])
        spans = self.js("""return [[2, 2], [2, 2.1], [1.9, 2.2], [3, 14], [1, 99], [1, 1e7]].map(([low, high]) => {
            const axis = logAxis(currentTheme(), "", [low, high]);
            return axis.tickvals?.length ?? 9; })""")
        self.assertGreaterEqual(min(spans), 3)

    @once
    def test_34_only_what_is_right_is_exact(self):
        cells = json.loads(self.js("return document.getElementById('data').textContent"))["cells"]
        still = [cell for cell in cells if cell["cost"] and cell["cost"]["variance"]["value"] == 0]
        wrong = [cell for cell in still if (cell["cost"]["floor"] or {}).get("high")]
        texts = self.js("return [...document.querySelectorAll('#matrix .graph')].flatMap((plot) => plot.layout?.annotations ?? []).map(({ text }) => text)")
        if texts:
            self.assertEqual(sum(text == "exact" for text in texts), len(still) - len(wrong))
            self.assertEqual(sum(text.startswith("no noise,") for text in texts), len(wrong))
        self.assertEqual(self.js("return report.cells.filter((cell) => cell.cost && isExact(cell)).length"), len(still) - len(wrong))
        best = self.js("""return matrixOf(matrixViews.variance_x_lookups).entries.flat()
            .filter(({ cell, relative }) => cell && relative !== null && relative < 1 && claimsUnbiased(cell)).length""")
        self.assertEqual(best, 0)
        self.detail = f"{len(wrong)} of {len(still)} without noise are wrong"

    def test_35_fronts_are_lines_and_zeros_are_grey(self):
        self.draw_all()
        self.assertEqual(self.js("""return [...document.querySelectorAll("#pareto .graph")].flatMap((plot) => plot.data)
            .filter(({ name, x }) => name === "front" && x.length < 2).length"""), 0)
        blanks = self.js("""return [...document.querySelectorAll("#maps .graph")].filter((plot) =>
            plot.data.some(({ z, customdata }) => z.some((row, y) => [...row].some((value, x) => Number.isNaN(value) && customdata[y][x] === 0))))
            .map((plot) => [plot.layout.plot_bgcolor, plot.getAttribute("aria-label")])""")
        for colour, text in blanks:
            self.assertEqual(colour, "#9a9a9a")
            self.assertIn("Grey: zero", text)

    @once_a_layout
    def test_32_other_views_have_data(self):
        for section in ["error", "matrix", "scaling", "maps"]:
            for at, select in enumerate(self.browser.find_elements(By.CSS_SELECTOR, f"#{section} > div > .controls select")):
                if not select.is_displayed():
                    continue
                before = select.get_attribute("value")
                values = [option.get_attribute("value") for option in Select(select).options][:4]
                for value in values:
                    Select(select).select_by_value(value)
                    self.js("document.getElementById(arguments[0]).scrollIntoView()", section)
                    plots = self.browser.find_elements(By.CSS_SELECTOR, f"#{section} .graph")
                    self.assertTrue(plots, f"{section}: {value}")
                    self.js("arguments[0].scrollIntoView()", plots[0])
                    self.wait(lambda: self.js("return Array.isArray(arguments[0].data) && arguments[0].data.length > 0", plots[0]))
                Select(select).select_by_value(before)

    # 4: filters, sorting

    @once_a_layout
    def test_40_filters_change_rows_and_plots(self):
        estimators = sorted({cell["estimator"] for cell in json.loads(self.js("return document.getElementById('data').textContent"))["cells"]})
        if len(estimators) < 2:
            self.skipTest("one estimator")
        box = self.facet("estimator", "None")
        self.assertEqual(self.shown_rows(), {})
        self.assertEqual(self.js(PLOTS), [])
        self.check_one(box, estimators[0])
        rows = self.shown_rows()
        labels = self.js("return JSON.parse(document.getElementById('data').textContent).cells.map((cell) => cell.estimator)")
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

    # 5: keyboard, paper, files

    @once_a_layout
    def test_50_tab_reaches_every_control(self):
        self.open("")
        controls = self.js(VISIBLE_CONTROLS)
        reached, unseen = set(), []
        body = self.find("body")
        for _ in range(len(controls) + 20):
            body.send_keys(Keys.TAB) if not reached else self.browser.switch_to.active_element.send_keys(Keys.TAB)
            element = self.browser.switch_to.active_element
            if element.id in reached or element.tag_name == "body":
                break
            reached.add(element.id)
            if self.js("return getComputedStyle(arguments[0]).outlineStyle", element) == "none":
                unseen.append(element.tag_name)
        missed = [self.js("return arguments[0].outerHTML.slice(0, 80)", one) for one in controls if one.id not in reached]
        self.assertEqual(missed, [])
        self.assertEqual(unseen, [])
        self.detail = f"{len(controls)} controls"

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

    def test_60_paper_has_all(self):
        self.prefer(self.theme, media="print")
        self.js("dispatchEvent(new Event('beforeprint'))")
        self.assertEqual(len(self.js(ROWS)), len(CELLS))
        self.assertEqual(self.js("return [...document.querySelectorAll('main details:not(.numbers)')].filter((one) => !one.open && !one.hidden).length"), 0)
        self.assertTrue(all(plot["drawn"] for plot in self.js(PLOTS)))
        self.assertEqual(self.js("return getComputedStyle(document.documentElement).backgroundColor"), "rgb(255, 255, 255)")
        self.assertEqual(self.js("return [...document.querySelectorAll('select, #side')].filter((one) => one.checkVisibility()).length"), 0)
        self.js("dispatchEvent(new Event('afterprint'))")
        self.prefer(self.theme)
        self.assertEqual(self.js("return document.documentElement.dataset.theme"), self.theme)

    @once
    def test_61_figures_come_as_files(self):
        self.open("?figures=1", ready="figures")
        figures = json.loads(self.js("return document.getElementById('figures').textContent"))
        self.assertGreater(len(figures), 0)
        names = [figure["name"] for figure in figures]
        self.assertEqual(len(set(names)), len(names))
        for figure in figures:
            self.assertRegex(figure["name"], r"^[a-z0-9-]+-[0-9]+$")
            self.assertTrue(any(re.sub("[^a-z0-9]+", "-", cell["experiment"].lower()) in figure["name"] for cell in CELLS) or "matrix" in figure["name"])
            self.assertTrue(figure["svg"].startswith("<svg"))
            self.assertTrue(base64.b64decode(figure["png"], validate=True).startswith(b"\x89PNG"))
        self.open("")
        self.detail = ", ".join(names[:3]) + f" and {len(names) - 3} more" if len(names) > 3 else ", ".join(names)

    # 9: what all that left behind

    def test_90_the_console_is_empty(self):
        self.tearDown()
        self.assertEqual(self.messages, [])

    def test_91_no_request_left_the_page(self):
        self.tearDown()
        self.assertGreater(len(self.requests), 0)
        self.assertEqual([url[:100] for url in self.requests if not re.match(r"(file|data|blob|about|chrome):", url)], [])


class OneLineEach(unittest.TestResult):
    passed = 0

    def line(self, word, test, detail=""):
        width, height = test.size
        what = test._testMethodName[8:].replace("_", " ")
        print(f"{word:5} {width}x{height} {test.theme:5}  {what}{': ' + detail if detail else ''}", flush=True)

    def startTest(self, test):
        super().startTest(test)
        self.began = time.monotonic()
        self.found_before = len(self.failures) + len(self.errors)

    def stopTest(self, test):
        super().stopTest(test)
        if any(test is one for one, _ in self.skipped):
            return
        if len(self.failures) + len(self.errors) > self.found_before:
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


def views():
    """All of a page that is soon read; of a large or an untimed one, whose looks are the same, the first."""
    every = [(size, theme) for size in SIZES for theme in THEMES]
    return every if len(CELLS) <= MANY_CELLS and timed() else every[:1]


def suite():
    tests = unittest.TestSuite()
    for size, theme in views():
        name = f"Page{size[0]}x{size[1]}{theme}"
        case = type(name, (PageTest,), {"size": size, "theme": theme})
        for test in unittest.defaultTestLoader.getTestCaseNames(case):
            if getattr(getattr(case, test), "wanted", lambda view: True)((size, theme)):
                tests.addTest(case(test))
    return tests


def main(arguments):
    global PAGE
    if len(arguments) < 2:
        print(__doc__.strip())
        return 2
    if webdriver is None or not shutil.which("chromium") or not shutil.which("chromedriver"):
        print("skipped: needs the Debian packages python3-selenium chromium chromium-driver")
        return 77
    PAGE = pathlib.Path(arguments[0]).resolve()
    read_results(arguments[1:])
    result = OneLineEach()
    began = time.monotonic()
    suite().run(result)
    failed = result.testsRun - result.passed - len(result.skipped)
    for test, trace in result.errors:
        if not hasattr(test, "_testMethodName"):  # a browser that did not start
            print(f"FAIL  {test}\n{trace}")
            failed += 1
    print(f"{time.monotonic() - began:.0f} s")
    print(f"{result.passed} passed, {failed} failed, {len(result.skipped)} skipped")
    return 0 if failed == 0 and result.passed > 0 else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
