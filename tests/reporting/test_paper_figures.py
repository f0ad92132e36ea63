"""A figure in the PDF is the figure of the page: what WeasyPrint would make of it, by less work."""

import base64
import re
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from html_page import whole_pdf

from gaitval.reporting import printer
from gaitval.reporting.painting import svg
from gaitval.reporting.paper_figures import Letters, _elements, operators, texts
from gaitval.reporting.sketch import Sketch
from gaitval.reporting.style import SKETCHED

X = np.linspace(0.0, 100.0, 101)


def test_a_path_has_its_letters_behind_its_numbers() -> None:
    assert operators("M1 2L3 -4zM5.5 6C1 2 3 4 5 6L7 8").split(b"\n") == [
        *(b"1 2 m", b"3 -4 l", b" h", b"5.5 6 m", b"1 2 3 4 5 6 c", b"7 8 l", b""),
    ]


@pytest.mark.parametrize(("anchor", "before"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
@pytest.mark.parametrize("place", ['x="1.00" y="2"', 'transform="translate(1 2) rotate(-90)"'])
def test_a_text_is_read_with_its_place(anchor: str, before: float, place: str) -> None:
    style = "fill: #404040" + f"; text-anchor: {anchor}" * (anchor != "start")
    kept = ' textLength="9.0" lengthAdjust="spacingAndGlyphs"'
    for length in ("", kept):
        given = f'<text {place} font-size="8.5"{length} style="{style}">a &lt; b</text>'
        assert list(texts(given)) == [
            Letters(1.0, 2.0, 8.5, "#404040", before, "rotate" in place, "a < b")
        ]


def test_every_text_and_every_line_of_a_sketch_is_read() -> None:
    """What is not read would be missing on paper alone."""
    picture = svg(made(), "a")
    assert len(list(texts(picture))) == picture.count("<text ") > 10
    assert len(list(_elements(picture))) == picture.count("<path d=") - picture.count("<clipPath")


def made() -> Sketch:
    figure = Sketch(2.0)
    left, right = figure.subplots(1, 2)[0]
    left.plot(X, np.sin(X / 9.0), color="#00558f", linestyle=(0, (6, 1.5)), label="sine")
    left.fill_between(X, X / 100.0, X / 50.0, color="#d96b0a", alpha=0.22)
    left.set_ylim(-0.5, 1.0)  # cuts both
    right.plot(X[::20], X[::20], color="#1a1a1a", marker="o", markerfacecolor="none")
    right.set_xlabel("% of gait cycle")
    return figure


@pytest.mark.slow  # lays two pages out
def test_it_is_drawn_as_weasyprint_would(tmp_path: Path) -> None:
    """Every point of its lines in the same place, with the same kinds of looks."""
    picture = svg(made(), "a")
    page = '<html><body><img alt="a" src="data:image/svg+xml;base64,{}"></body></html>'
    both = []
    for text in (picture, picture.replace(SKETCHED, 'font-family="Report"')):
        target = BytesIO()
        own = tmp_path / str(len(both))
        own.mkdir()
        coded = base64.b64encode(text.encode()).decode()
        with whole_pdf():
            printer.layouter("a4", own)(page.format(coded)).write_pdf(target)
        streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", target.getvalue(), re.DOTALL)
        plain = (zlib.decompress(each) if each[:1] == b"x" else each for each in streams)
        both.append(next(each for each in plain if b" re\n" in each or b" l\n" in each))
    for kind in (b"RG", b"rg", b"/a0.22 gs", b" J", b" d"):
        assert [kind in each for each in both] == [True, True], kind
    ours, theirs = (re.findall(rb"(-?[\d.]+) (-?[\d.]+) l\n", each) for each in both)
    assert len(ours) == len(theirs) > 100
    away = np.array(ours, dtype=float) - np.array(theirs, dtype=float)
    assert np.abs(away).max() < 0.01
