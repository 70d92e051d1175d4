"""Window sizes and themes in which the page is looked at."""

from .results import CELLS, FILES, timed

# Above and below the widths at which the page changes its layout.
SIZES = [(1366, 768), (390, 844)]
THEMES = ["light", "dark"]
MANY_CELLS = 200


def views():
    """All of a page that is soon read; of a large one, an untimed one or one of several results, whose looks are the same, the first."""
    every = [(size, theme) for size in SIZES for theme in THEMES]
    return every if len(CELLS) <= MANY_CELLS and timed() and len(FILES) == 1 else every[:1]


def once(test):
    """What the page says and knows is the same at every size and in every theme."""
    test.wanted = lambda view: view == views()[0]
    return test


def once_a_layout(test):
    """What hands do depends on where things stand, not on their colours."""
    test.wanted = lambda view: view[1] == THEMES[0]
    return test
