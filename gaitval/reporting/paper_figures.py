"""Figures on paper: lines and areas of a painted sketch as a PDF has them, texts by WeasyPrint.

WeasyPrint reads an image number by number, which took half of the time of writing a PDF. What
`painting` writes has absolute lines, curves and ends alone, and these are those of a PDF, where the
letter follows its numbers.
"""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

from gaitval.reporting.font_widths import width
from gaitval.reporting.style import POINTS

if TYPE_CHECKING:
    from weasyprint.images import SVGImage

_FIGURE: Final = re.compile(r'<svg [^>]*?(width="([\d.]+)pt" height="([\d.]+)pt"[^>]*)>(.*)</svg>')
_ELEMENT: Final = re.compile(
    r'<clipPath id="(?P<id>[^"]*)"><path d="(?P<area>[^"]*)"/></clipPath>'
    r'|<g clip-path="url\(#(?P<clip>[^"]*)\)">(?P<inside>.*?)</g>'
    r'|<path (?:class="(?P<class>[^"]*)" )?d="(?P<d>[^"]*)" style="(?P<style>[^"]*)"/>'
)
_TEXT: Final = re.compile(r"<text .*?</text>")
_ANCHORED: Final = re.compile(
    r'(?P<place>x="(?P<x>[^"]*)" y="[^"]*"|transform="[^"]*") font-size="(?P<size>[\d.]+)"'
    r'(?: textLength="[^"]*" lengthAdjust="[^"]*")? '
    r'style="fill: (?P<fill>[^;"]*)(?:; text-anchor: (?P<anchor>\w+))?">(?P<text>.*?)<'
)
_STEP: Final = re.compile("([MLCz])([^MLCz]*)")
_LETTERS: Final = str.maketrans("MLCz", "mlch")
_CAPS: Final = {"square": 2, "butt": 0}
_JOINS: Final = {"round": 1, "miter": 0}
_PIXELS: Final = 96.0 / POINTS


def operators(path: str) -> bytes:
    """A `path` of SVG with the letters M, L, C and z as a path of a PDF."""
    return _STEP.sub(r"\2 \1\n", path).translate(_LETTERS).encode("ascii")


def letters(text: str) -> str:
    """A <text> element that begins where it stands: WeasyPrint makes a picture of its own of each
    that ends there or has its middle there. The widths are those of the page's font.
    """

    def begun(found: re.Match[str]) -> str:
        size, place = float(found["size"]), found["place"]
        part = {"middle": 0.5, "end": 1.0}.get(found["anchor"] or "", 0.0)
        back = part * width(_plain(found["text"]), size)
        if found["x"] is not None:
            place = place.replace(f'x="{found["x"]}"', f'x="{float(found["x"]) - back:.2f}"', 1)
        elif back:
            place = f'x="{-back:.2f}" y="0" {place}'
        return f'{place} font-size="{size:g}" fill="{found["fill"]}">{found["text"]}<'

    return _ANCHORED.sub(begun, text)


def _plain(text: str) -> str:
    for name, letter in (("&lt;", "<"), ("&gt;", ">"), ("&quot;", '"'), ("&#x27;", "'")):
        text = text.replace(name, letter)
    return text.replace("&amp;", "&")


class PaperFigure:
    """An image of WeasyPrint: a painted sketch."""

    def __init__(self, svg: str, fonts: Any) -> None:
        found = _FIGURE.match(svg)
        assert found is not None
        attributes, wide, high, content = found.groups()
        self._size = float(wide), float(high)
        self._elements = list(_elements(content))
        texts = "".join(letters(each) for each in _TEXT.findall(content))
        root = f'<svg xmlns="http://www.w3.org/2000/svg" {attributes} font-family="Report">'
        self._texts = f"{root}{texts}</svg>"
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
        stream.pop_state()
        self._lettering().draw(stream, wide, high, None)

    def _lettering(self) -> "SVGImage":
        from types import SimpleNamespace

        from weasyprint.images import SVGImage

        context = SimpleNamespace(font_config=self._fonts, dictionaries={})
        return SVGImage(ElementTree.fromstring(self._texts), "", None, context)


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
