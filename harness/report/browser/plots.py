"""Every plot is there and shows data."""

import re

from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from .page import PLOTS, PageTest
from .results import CELLS, timed
from .views import once, once_a_layout


def has_two_costs(cell):
    """Of a cell of the page's data: a time and a variance that is more than rounding."""
    cost, timing = cell["cost"], cell["time"]
    return bool(cost and timing and timing["ns_per_sample"] and cost["variance"]["value"] > (1e-10 * cost["reference"]) ** 2)


class PlotsTest(PageTest):
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
        data = self.js("return report")

        def scenes(has):
            return sum(any(has(data["cells"][entry["cell"]]) for entry in scene["ranking"]) for scene in data["scenes"])

        def one_or_few(number):
            return number if number <= 4 else 1

        timed = scenes(lambda cell: any((step["seconds"] or {}).get("value") and step["rmse"]["value"] for step in cell["convergence"]))
        untimed = scenes(lambda cell: any(step["lookups"] and step["rmse"]["value"] for step in cell["convergence"]))
        self.assertEqual(count.get("error", 0), one_or_few(timed or untimed))
        self.assertEqual(count.get("pareto", 0), one_or_few(scenes(has_two_costs)))
        reached = scenes(lambda cell: cell["cost"] and cell["cost"]["seconds"][0]["reached"] and cell["cost"]["seconds"][0]["value"])
        self.assertEqual(count.get("times", 0), one_or_few(reached))
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
    def test_36_times_are_sorted_and_named(self):
        self.draw_all()
        plots = self.js("""return [...document.querySelectorAll("#times .graph")].map((plot) => ({
            seconds: plot.data.map(({ x }) => x[0]), rows: plot.data.map(({ y }) => y[0]), names: plot.layout.yaxis.ticktext }))""")
        self.assertEqual(bool(plots), timed())
        for plot in plots:
            self.assertEqual(plot["seconds"], sorted(plot["seconds"]))
            self.assertEqual(plot["rows"], list(range(len(plot["names"]))))
            self.assertEqual(len(plot["seconds"]), len(plot["names"]))

    @once
    def test_39_each_scene_says_who_is_fastest_and_what_is_proven_of_it(self):
        if not timed():
            self.skipTest("nothing was timed")
        scenes = self.js("""return report.scenes.filter((scene) => cellsOf(scene).some(reachesTheError) && unbiasedWinnersOf(scene).length > 0).map((scene) => ({
            said: timesCaption(scene), cells: unbiasedWinnersOf(scene).map((entry) => report.cells[entry.cell]),
            ratios: Object.fromEntries(cellsOf(scene).filter((cell) => cell.type === "ratio").map((cell) => [cell.run, cell.cost?.seconds[0].value ?? null])) }))""")
        self.assertTrue(scenes)
        for scene in scenes:
            for cell in scene["cells"]:
                self.assertIn(cell["label"], scene["said"])
                self.assertIn(f"; {cell['marked_word']})", scene["said"])
                told = re.search(re.escape(cell["label"]) + r" \([^;]*, ([\d.e−]+) times the time of ratio(?:/samples:\d+)?;", scene["said"])
                ratio = scene["ratios"].get(str(cell["run"]))
                if ratio and cell["type"] != "ratio":
                    share = cell["cost"]["seconds"][0]["value"] / ratio
                    self.assertAlmostEqual(float(told[1].replace("−", "-")) / share, 1, delta=0.06)

    @once
    def test_38_a_pass_of_an_own_mean_has_a_mark_of_its_own(self):
        if not timed():
            self.skipTest("nothing was timed")
        self.draw_all()
        names = self.js("return [...document.querySelectorAll('#times .graph')].flatMap((plot) => plot.layout.yaxis.ticktext)")
        own = self.js("""return [...document.querySelectorAll('#times .graph')].flatMap((plot) => plot.data)
            .filter(({ text }) => text[0].includes('own mean')).length""")
        self.assertEqual(sum(name.endswith("(✓)") for name in names), own)
        badges = self.js("return [...document.querySelectorAll('.badge.pass')].map((one) => one.textContent).filter((text) => text.includes('own mean'))")
        self.assertTrue(all(badge.startswith("(✓) PASS") for badge in badges), badges)
        captions = self.js("return [...document.querySelectorAll('#times figcaption')].map((one) => one.textContent).join()")
        self.assertIn("which may be biased" if own else "PASS", captions)
        self.detail = f"{own} own means in plots, {len(badges)} badges"

    @once
    def test_34_only_what_is_right_is_exact(self):
        cells = self.js("return report")["cells"]
        still = [cell for cell in cells if cell["cost"] and cell["cost"]["variance"]["value"] == 0]
        wrong = [cell for cell in still if (cell["cost"]["floor"] or {}).get("high")]
        texts = self.js("return [...document.querySelectorAll('#matrix .graph')].flatMap((plot) => plot.layout?.annotations ?? []).map(({ text }) => text)")
        if texts:
            self.assertEqual(sum(text == "exact" for text in texts), len(still) - len(wrong))
            self.assertEqual(sum(text.startswith("no noise,") for text in texts), len(wrong))
        self.assertEqual(self.js("return report.cells.filter((cell) => cell.cost && isExact(cell)).length"), len(still) - len(wrong))
        best = self.js("""return matrixOf(matrixViews.variance_x_lookups).entries.flat()
            .filter(({ cell, relative }) => cell && relative !== null && relative < 1 && standsUnbiased(cell)).length""")
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
                    self.draw(plots[0])
                Select(select).select_by_value(before)

    def test_37_nothing_of_the_plots_of_time_is_cut_or_covered(self):
        if not timed():
            self.skipTest("nothing was timed")
        self.draw_all()
        bad = self.js("""return [...document.querySelectorAll('#times .graph')].flatMap((plot) => {
            const box = (one) => one.getBoundingClientRect(), whole = box(plot), title = box(plot.querySelector('.xtitle'));
            const ticks = [...plot.querySelectorAll('.xtick text')], names = [...plot.querySelectorAll('.ytick text')];
            return [...ticks.filter((one) => box(one).bottom > title.top + 2), ...names.filter((one) => box(one).left < whole.left - 1),
                    ...(title.right > whole.right + 1 ? [plot.querySelector('.xtitle')] : [])].map((one) => one.textContent);
        })""")
        self.assertEqual(bad, [])
