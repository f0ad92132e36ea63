"""How wide a text is in the font of pages and figures, from the font's own tables."""

import struct
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

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
    """The advance width of each character over the font's size, by code point (OpenType: cmap of
    format 4, hhea, hmtx, head).
    """
    content = (fonts_folder() / _FONT).read_bytes()
    count = struct.unpack_from(">H", content, 4)[0]
    tables = {
        content[at : at + 4]: struct.unpack_from(">I", content, at + 8)[0]
        for at in range(12, 12 + 16 * count, 16)
    }
    per_em = struct.unpack_from(">H", content, tables[b"head"] + 18)[0]
    measured = struct.unpack_from(">H", content, tables[b"hhea"] + 34)[0]
    advance = struct.unpack_from(">" + "Hh" * measured, content, tables[b"hmtx"])[::2]
    return {
        code: advance[min(glyph, measured - 1)] / per_em
        for code, glyph in _glyphs(content, tables[b"cmap"]).items()
    }


def _glyphs(content: bytes, cmap: int) -> dict[int, int]:
    """Glyph of each code point of the basic plane."""
    (tables,) = struct.unpack_from(">H", content, cmap + 2)
    places = (struct.unpack_from(">HHI", content, cmap + 4 + 8 * i) for i in range(tables))
    at = cmap + next(
        offset for *_, offset in places if struct.unpack_from(">H", content, cmap + offset)[0] == 4
    )
    segments = struct.unpack_from(">H", content, at + 6)[0] // 2
    row = struct.Struct(f">{segments}H")
    signed = struct.Struct(f">{segments}h")
    ends = row.unpack_from(content, at + 14)
    starts = row.unpack_from(content, at + 16 + 2 * segments)
    deltas = signed.unpack_from(content, at + 16 + 4 * segments)
    of_ranges = at + 16 + 6 * segments
    ranges = row.unpack_from(content, of_ranges)
    found = {}
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        for code in range(start, min(end, 0xFFFE) + 1):
            glyph = code
            if ranges[number]:
                place = of_ranges + 2 * number + ranges[number] + 2 * (code - start)
                glyph = struct.unpack_from(">H", content, place)[0]
                if not glyph:
                    continue
            found[code] = (glyph + deltas[number]) & 0xFFFF
    return found


def width(text: str, size: float) -> float:
    """Width of one line of `text`, in the unit of `size`."""
    known = _widths()
    return size * sum(known.get(ord(letter), _OTHERWISE) for letter in text)
