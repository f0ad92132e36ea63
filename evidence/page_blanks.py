"""The largest blank block of each page of a PDF: what a reader sees as a half-empty sheet.

Poppler's `pdftoppm` draws the pages.
"""

import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RESOLUTION = 50
"""Dots per inch: a printed line of text is 6 dots high, and gaps between lines are no blocks."""
MARGINS_MM = (19.0, 15.0, 18.0, 15.0)
"""Of `@page` in report.css: top, right, bottom, left. They are blank on every page."""
WHITE = 250
"""A rule of a table, drawn in light grey, is no blank."""


def pages(pdf: Path) -> list[NDArray[np.uint8]]:
    """Grey values of the area within the margins of each page."""
    drawn = subprocess.run(
        ["pdftoppm", "-r", str(RESOLUTION), "-gray", str(pdf)], check=True, capture_output=True
    ).stdout
    found = []
    while drawn:
        magic, size, _, rest = drawn.split(b"\n", 3)
        if magic != b"P5":
            raise ValueError(f"{pdf}: pdftoppm wrote {magic!r}, not grey pages")
        width, height = map(int, size.split())
        image = np.frombuffer(rest[: width * height], np.uint8).reshape(height, width)
        top, right, bottom, left = (round(mm / 25.4 * RESOLUTION) for mm in MARGINS_MM)
        found.append(image[top : height - bottom, left : width - right])
        drawn = rest[width * height :]
    return found


def largest_blank(page: NDArray[np.uint8]) -> float:
    """Area of the largest rectangle without ink / area of the page."""
    largest = 0
    heights = np.zeros(page.shape[1], dtype=int)
    for row in page >= WHITE:
        heights = np.where(row, heights + 1, 0)
        largest = max(largest, _largest_under(heights.tolist()))
    return largest / page.size


def _largest_under(heights: list[int]) -> int:
    """Area of the largest rectangle under a histogram."""
    largest = 0
    open_at: list[tuple[int, int]] = []  # where a bar of a height begins, heights ascending
    for place, height in enumerate([*heights, 0]):
        begin = place
        while open_at and open_at[-1][1] >= height:
            begin, lower = open_at.pop()
            largest = max(largest, lower * (place - begin))
        open_at.append((begin, height))
    return largest


def blanks(pdf: Path) -> list[float]:
    """The largest blank of each page, as a fraction of the area within its margins."""
    return [largest_blank(page) for page in pages(pdf)]
