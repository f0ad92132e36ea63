"""Draws figures higher where a page of the PDF would end half empty.

A figure that does not fit goes to the next page, with the table that belongs to it. The gap that it
leaves is shared among the figures above it, which moves nothing to another page.
"""

from collections.abc import Iterator
from typing import Any, Final

NAME: Final = "data-figure"
"""Attribute with the name of a figure that may be drawn higher."""
SMALLEST_GAP: Final = 0.06
"""Fraction of a page that may stay empty: about two lines and a heading."""
LARGEST_STRETCH: Final = 1.9
"""Beyond it curves look steeper than they are read elsewhere."""


def stretches(document: Any) -> dict[str, float]:
    """Factors of the heights of figures, by name, that fill the pages of `document`, a laid-out
    `weasyprint.Document`. Its last page is left as it ends.
    """
    found: dict[str, float] = {}
    for page in document.pages[:-1]:
        sheet = page._page_box  # there is no public way to ask where a figure is
        content = sheet.children[0]
        gap = sheet.content_box_y() + sheet.height - _end(content)
        figures = list(_figures(content))
        if gap < SMALLEST_GAP * sheet.height or not figures:
            continue
        # a margin, so that rounding of the layout pushes nothing to the next page
        room = gap - 0.5 * SMALLEST_GAP * sheet.height
        factor = min(LARGEST_STRETCH, 1.0 + room / sum(box.height for _, box in figures))
        found |= {name: factor for name, _ in figures}
    return found


def _boxes(box: Any) -> Iterator[Any]:
    yield box
    for child in getattr(box, "children", ()):
        yield from _boxes(child)


def _end(content: Any) -> float:
    """Lower edge of the last thing that is seen."""
    # boxes with children may be as high as the page, whatever is in them
    leaves = [box for box in _boxes(content) if not getattr(box, "children", ())]
    return max((box.position_y + box.margin_height() for box in leaves), default=0.0)


def _figures(content: Any) -> Iterator[tuple[str, Any]]:
    for box in _boxes(content):
        element = box.element
        if element is not None and box.element_tag == "img" and element.get(NAME):
            yield element.get(NAME), box
