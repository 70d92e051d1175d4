"""Numbers and words of the page are those of the results."""

import os
import re
import subprocess

from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from .page import PageTest
from .results import CELLS, FILES, TABLES, VERSIONS, numbers_of, same, shown_number, timed
from .views import once, once_a_layout


class ContentsTest(PageTest):
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
                texts = self.js(f"""return [...document.querySelectorAll("[data-table='{index}'] [data-row='{at}'] [data-key=table]")].map((one) => one.textContent)""")
                for heading, number in row.get("given", {}).items():
                    self.assertEqual(dict(zip(heads, texts))[heading], str(number))  # as the configuration has it
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
        if not self.js("return Object.values(report.images).length"):
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
    def test_28_the_fastest_are_those_of_compare(self):
        said = self.js("return document.querySelector('#summary details > summary')?.textContent ?? ''").replace("\u00a0", " ")
        lines = subprocess.run([os.environ["NULLMARK_PROGRAM"], "compare", *FILES], capture_output=True, text=True).stdout.splitlines()
        if not timed():
            self.skipTest("nothing was timed")
        self.assertEqual(said, lines[0])

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

    @once
    def test_28_claims_show_their_verdicts(self):
        claims = self.js("return report.claims")
        if not claims:
            self.skipTest("the results have no claims")
        rows = self.browser.find_elements(By.CSS_SELECTOR, "#claims tbody tr")
        self.assertEqual(len(rows), len(claims))
        for row, claim in zip(rows, claims):
            text = row.text
            for expected in [claim["id"], claim["finding"], claim["claim"], claim["source"]] + [part["figures"] for part in claim["parts"]]:
                self.assertIn(expected, text)
        self.detail = f"{len(claims)} claims"

    @once
    def test_29_a_history_says_what_changed(self):
        history = self.js("return report.history")
        self.assertEqual(bool(self.browser.find_elements(By.CSS_SELECTOR, "#history")), history is not None)
        if history is None:
            self.skipTest("the results are no series")
        self.assertEqual(self.find("#history .meaning").text, history["says"])
        shown = self.js("""return [...[...document.querySelectorAll('#history h3')].at(-1).nextElementSibling.querySelectorAll('tbody tr')]
            .map((row) => row.cells[1].textContent)""")
        self.assertEqual(shown[-2::-1] + shown[-1:], [step["says"] for step in history["steps"]] + ["–"])
        last = history["steps"][-1]
        rows = self.js("return [...document.querySelectorAll('#history .history:first-of-type')].map((one) => one.tBodies[0].rows.length)")
        if last["changes"]:
            self.assertEqual(rows[0], len(last["changes"]))
        self.js("document.querySelector('#history details.numbers').open = true")
        self.wait(lambda: self.find("#history details.numbers table"))
        drawn = self.js("""return [...document.querySelectorAll('#history details.numbers tbody tr')].map((row) =>
            [...row.querySelectorAll('.spark')].map((one) => one.querySelectorAll('circle').length))""")
        self.assertEqual(len(drawn), len(history["cells"]))
        for cell, points in zip(history["cells"], drawn):
            series = [cell[key] for key in ["lookups", "rmse", "variance", "ns_per_sample"]]
            self.assertEqual(points, [count for count in (sum(x is not None for x in one) for one in series) if count])
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": False})
        # Plots that are drawn follow the width a moment later.
        self.wait(lambda: self.js("return document.documentElement.scrollWidth") <= 390)
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                     {"width": self.size[0], "height": self.size[1], "deviceScaleFactor": 1, "mobile": False})
        self.js("document.querySelector('#history details.numbers').open = false")
        self.detail = f"{history['says']}; {sum(map(len, drawn))} series"

    @once
    def test_2c_violations_are_not_summed_over_trackers(self):
        said = self.js("return violationsText([{ violations: 5, largest_violation: 1.5 }, { violations: 3, largest_violation: 2 }])")
        self.assertIn("up to 5 lookups of a cell above the bound", said)
        self.assertIn("at most 2 times", said)

    @once
    def test_2d_a_legend_gives_epsilon_and_whose_marks_it_counts(self):
        said = self.js("return passText([{ verdict: { excludes: 0.0037 } }, { verdict: { excludes: 0.02 } }, { verdict: null }])").replace("\u00a0", " ")
        self.assertEqual(said, "a bias above epsilon is ruled out (epsilon 0.37 % to 2 % of the mean)")
        self.assertEqual(self.js("return marksText([{ marks: ['own mean'] }, { marks: [] }]).textContent"), "(of them 1 own mean) ")
        passed = self.js("return marksMeaning(report.cells.filter((cell) => outcomeOf(cell) === 'PASS' && !cell.marks.includes('own mean')))")
        if passed:
            self.assertRegex(passed, r"ruled out \(epsilon ")

    @once
    def test_2b_results_of_one_tracker_are_no_rivals(self):
        if len(FILES) < 2 or not timed():
            self.skipTest("one result, or untimed ones")
        said = self.js("""return report.scenes.map((scene) => {
            const ranking = scene.ranking.map((entry) => ({ ...entry, rank: 1, tied: true, split: false }));
            const all = { ...scene, ranking };
            return { answer: answerOf(all), times: namesAndSeconds(ranking)[1], trackers: new Set(ranking.map(({ cell }) => report.cells[cell].estimator)).size,
                     unbiased: new Set(ranking.map(({ cell }) => report.cells[cell]).filter((cell) => cell.unbiased).map((cell) => cell.estimator)).size,
                     count: ranking.length, tally: tally([all], winnersOf),
                     split: tally([{ ...scene, ranking: ranking.map((entry) => ({ ...entry, split: true })) }], winnersOf) };
        })""")
        for one in said:
            self.assertTrue(one["count"] == one["trackers"] or one["split"] != one["tally"])
            self.assertGreater(one["count"], one["trackers"])
            self.assertEqual(one["answer"].count(", tied with "), one["unbiased"] - 1)
            self.assertEqual(one["times"].count(" = "), one["trackers"] - 1)
            self.assertNotIn("samples:", one["tally"])
            self.assertNotRegex(one["answer"], r"ratio/samples:\d+ \([^)]*times the time of ratio/")
        planned = self.js("return plannedText(report.cells.filter((cell) => outcomeOf(cell) === 'INCONCLUSIVE (as planned)'))")
        words = {}
        for cell in self.js("return report.cells.map((cell) => [cell.name, outcomeOf(cell)])"):
            words.setdefault(cell[0], []).append(cell[1])
        decided = sum("INCONCLUSIVE (as planned)" in own and "PASS" in own for own in words.values())
        self.assertGreater(decided, 0)
        self.assertRegex(planned, rf"; with the samples of another of these results, {decided} of these cells (is|are) decided$")
        self.detail = f"{len(said)} scenes, {decided} cells that other samples decide"

    @once
    def test_2a_the_matrix_counts_every_cell(self):
        wanted = self.js("return report.scenes.length > manyScenes && report.cells.some((cell) => cell.verdict)")
        rows = self.js("""return [...document.querySelectorAll("#outcomes tbody tr")].map((row) =>
            [row.children[0].textContent, row.children[1].textContent, row.querySelectorAll(".field").length])""")
        self.assertEqual(bool(rows), wanted)
        if not wanted:
            self.skipTest("few scenes, or none judged")
        for tracker, text, fields in rows:
            own = [cell for cell in CELLS if cell["estimator"]["type"] == tracker]
            passed = sum((cell["verdict"] or {}).get("unbiased") == "PASS" for cell in own)
            self.assertRegex(text, rf"^{passed} of {len(own)} PASS")
            self.assertEqual(fields, len({cell["medium"]["type"] for cell in own}))
        self.assertEqual(len({row[0] for row in rows}), len({cell["estimator"]["type"] for cell in CELLS}))
        field = self.find("#outcomes .field[aria-label^='ratio on ']")
        self.js("arguments[0].click()", field)
        medium = field.get_attribute("aria-label").split(":")[0].split(" on ")[1]
        own = sum(cell["estimator"]["type"] == "ratio" and cell["medium"]["type"] == medium for cell in CELLS)
        self.assertRegex(self.find("#shown").text, rf"of {own}$")
        self.js("chooseOutcome('')")
        self.assertRegex(self.find("#shown").text, rf"of {len(CELLS)}$")
        self.detail = f"{len(rows)} trackers"
