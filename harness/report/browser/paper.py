"""The page on paper, and its plots as files."""

import base64
import json
import re

from .page import PLOTS, ROWS, PageTest
from .results import CELLS
from .views import once


class PaperTest(PageTest):
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
