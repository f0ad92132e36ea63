"""Sizes that all figures have."""

from typing import Final

WIDTH: Final = 7.1
"""Inches; the text width of an A4 page."""
POINTS: Final = 72.0
"""In an inch."""
FONT: Final = 8.5
"""Points, of all texts but titles."""
TITLE: Final = 9.0
AXES_LINE: Final = 0.5
TICK: Final = 2.5
"""Points; the length of a mark."""
LINE: Final = 1.2
SKETCHED: Final = 'class="sketch"'
"""Of the <svg> elements made here: the style sheet gives them a font with the page's widths."""
