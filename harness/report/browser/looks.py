"""The page is there, fits its window and follows its theme."""

import re

from .page import PageTest
from .results import CELLS

SECONDS_TO_OPEN = 10  # a bound for loaded machines; what it took is printed


def contrast(one, other):
    def luminance(colour):
        channels = [int(c) / 255 for c in re.findall(r"\d+", colour)[:3]]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted([luminance(one), luminance(other)], reverse=True)
    return (light + 0.05) / (dark + 0.05)


class LooksTest(PageTest):
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
