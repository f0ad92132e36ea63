"""Figures on paper: lines and areas of a painted sketch as a PDF has them, texts by WeasyPrint.

WeasyPrint reads an image number by number, which took half of the time of writing a PDF. What
`painting` writes has absolute lines, curves and ends alone, and these are those of a PDF, where the
letter follows its numbers.
"""

import math
import re
from collections.abc import Iterator
from html import unescape
from typing import Any, Final, NamedTuple

from gaitval.reporting.style import POINTS

_FIGURE: Final = re.compile(r'<svg [^>]*?width="([\d.]+)pt" height="([\d.]+)pt"[^>]*>(.*)</svg>')
_ELEMENT: Final = re.compile(
    r'<clipPath id="(?P<id>[^"]*)"><path d="(?P<area>[^"]*)"/></clipPath>'
    r'|<g clip-path="url\(#(?P<clip>[^"]*)\)">(?P<inside>.*?)</g>'
    r'|<path (?:class="(?P<class>[^"]*)" )?d="(?P<d>[^"]*)" style="(?P<style>[^"]*)"/>'
)
_TEXT: Final = re.compile(
    r'<text (?:x="(?P<x>[^"]*)" y="(?P<y>[^"]*)"'
    r'|transform="translate\((?P<right>\S+) (?P<down>\S+)\) rotate\(-90\)") '
    r'font-size="(?P<size>[\d.]+)"(?: textLength="[^"]*" lengthAdjust="[^"]*")? '
    r'style="fill: (?P<fill>[^;"]*)(?:; text-anchor: (?P<anchor>\w+))?">(?P<text>[^<]*)</text>'
)
_BEFORE: Final = {"middle": 0.5, "end": 1.0}
"""What part of a text stands before its place."""
_STEP: Final = re.compile("([MLCz])([^MLCz]*)")
_LETTERS: Final = str.maketrans("MLCz", "mlch")
_CAPS: Final = {"square": 2, "butt": 0}
_JOINS: Final = {"round": 1, "miter": 0}
_PIXELS: Final = 96.0 / POINTS


def operators(path: str) -> bytes:
    """A `path` of SVG with the letters M, L, C and z as a path of a PDF."""
    return _STEP.sub(r"\2 \1\n", path).translate(_LETTERS).encode("ascii")


class Letters(NamedTuple):
    """A line of text: where its baseline begins, has its middle or ends, points, by `before`, the
    part of its width that stands before that; `turned` runs upwards.
    """

    x: float
    y: float
    size: float
    colour: str
    before: float
    turned: bool
    text: str


def texts(content: str) -> Iterator[Letters]:
    """The texts of a painted sketch."""
    for found in _TEXT.finditer(content):
        turned = found["x"] is None
        yield Letters(
            float(found["right" if turned else "x"]),
            float(found["down" if turned else "y"]),
            float(found["size"]),
            found["fill"],
            _BEFORE.get(found["anchor"] or "", 0.0),
            turned,
            unescape(found["text"]),
        )


class PrintedFigure:
    """An image of WeasyPrint: a painted sketch."""

    def __init__(self, svg: str, fonts: Any) -> None:
        found = _FIGURE.match(svg)
        assert found is not None
        wide, high, content = found.groups()
        self._size = float(wide), float(high)
        self._elements = list(_elements(content))
        self._texts = list(texts(content))
        self._fonts = fonts

    def get_intrinsic_size(self, _resolution: float, _font_size: float) -> tuple[float, ...]:
        """Width and height, px, and their ratio."""
        wide, high = self._size
        return wide * _PIXELS, high * _PIXELS, wide / high

    def draw(self, stream: Any, wide: float, high: float, _style: object) -> None:
        """Draw it on a `stream` of a page, `wide` by `high` px."""
        stream.push_state()
        stream.transform(a=wide / self._size[0], d=high / self._size[1])
        for path, style, clip in self._elements:
            stream.push_state()
            if clip:
                stream.stream.append(operators(clip) + b"W n")
            _look(stream, path, style)
            stream.pop_state()
        self._write(stream)
        stream.pop_state()

    def _write(self, stream: Any) -> None:
        """Write the texts, each whole: WeasyPrint's own SVG lays out every letter, and makes a
        picture of its own of each text that ends or has its middle in its place.
        """
        from weasyprint.css.properties import INITIAL_VALUES
        from weasyprint.draw.text import draw_first_line
        from weasyprint.matrix import Matrix
        from weasyprint.svg.text import Style, TextBox
        from weasyprint.text.line_break import split_first_line

        for each in self._texts:
            style = Style(INITIAL_VALUES)
            style.font_config = self._fonts
            style |= {"font_family": ["Report"], "font_size": each.size}
            layout, _, _, wide, _, baseline = split_first_line(each.text, style, None, math.inf, 0)
            back = each.before * wide
            matrix = (
                Matrix(0, -1, -1, 0, each.x, each.y + back)
                if each.turned
                else Matrix(a=1, d=-1, e=each.x - back, f=each.y)
            )
            box = TextBox(layout, style)
            box.baseline = baseline
            stream.push_state()
            stream.set_color(_colour(each.colour, None))
            stream.begin_text()
            layout.reactivate(style)
            draw_first_line(stream, box, "none", "none", matrix)
            stream.end_text()
            stream.pop_state()


def _elements(content: str) -> Iterator[tuple[str, dict[str, str], str]]:
    """Path, style and clip of everything that is drawn."""
    clips: dict[str, str] = {}
    for found in _ELEMENT.finditer(content):
        if found["id"]:
            clips[found["id"]] = found["area"]
        elif found["clip"]:
            for path, style, _ in _elements(found["inside"]):
                yield path, style, clips[found["clip"]]
        elif not found["class"]:
            pairs = (each.split(": ", 1) for each in found["style"].split("; "))
            yield found["d"], {name: value for name, value in pairs}, ""


def _look(stream: Any, path: str, style: dict[str, str]) -> None:
    """Fill and stroke a `path`."""
    filled, stroked = style.get("fill", "none") != "none", "stroke" in style
    if filled:
        stream.set_color(_colour(style["fill"], style.get("fill-opacity")))
    if stroked:
        stream.set_color(_colour(style["stroke"], style.get("stroke-opacity")), stroke=True)
        stream.set_line_width(float(style["stroke-width"]))
        stream.set_line_cap(_CAPS[style.get("stroke-linecap", "butt")])
        stream.set_line_join(_JOINS[style.get("stroke-linejoin", "miter")])
        if dashes := style.get("stroke-dasharray"):
            stream.set_dash([float(each) for each in dashes.split()], 0)
    end = {(True, True): b"B", (True, False): b"f", (False, True): b"S"}[filled, stroked]
    stream.stream.append(operators(path) + end)


def _colour(text: str, opacity: str | None) -> Any:
    """A colour of a PDF."""
    from tinycss2.color5 import parse_color  # type: ignore[import-untyped]

    found = parse_color(text)
    assert found is not None
    if opacity is not None:
        found.alpha = float(opacity)
    return found
