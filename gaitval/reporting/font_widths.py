"""How wide a text is in the font of pages and figures, from the font's own tables."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from fontTools.ttLib import TTFont  # type: ignore[import-untyped]

_FONT: Final = "STIXGeneral.ttf"
_OTHERWISE: Final = 0.5
"""Width of a letter that the font lacks, of its size."""


def fonts_folder() -> Path:
    """Where matplotlib has the fonts of pages and figures. It takes a third of a second to load,
    so it is looked for and not loaded.
    """
    found = find_spec("matplotlib")
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).parent / "mpl-data" / "fonts" / "ttf"


@cache
def _widths() -> dict[int, float]:
    """The advance width of each character over the font's size, by code point."""
    with TTFont(fonts_folder() / _FONT, lazy=True) as font:
        advances, per_em = font["hmtx"], font["head"].unitsPerEm
        return {code: advances[glyph][0] / per_em for code, glyph in font.getBestCmap().items()}


def width(text: str, size: float) -> float:
    """Width of one line of `text`, in the unit of `size`."""
    known = _widths()
    return size * sum(known.get(ord(letter), _OTHERWISE) for letter in text)
