"""A page of a report as its tests read it."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import TextIO

import pytest
import weasyprint
from markupsafe import Markup
from matplotlib.figure import Figure

_RENDER = weasyprint.HTML.render

EMPTY = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="511pt" height="200pt" '
    'viewBox="0 0 511 200"></svg>'
)
"""Stands for a figure."""
WITHOUT_FIGURES = f"""
import gaitval.reporting.page
from markupsafe import Markup

gaitval.reporting.page._drawings = lambda draws: dict.fromkeys(draws, Markup({EMPTY!r}))
"""
"""What a program runs before a command whose page shall have no figures."""


WORDS_ALONE = (
    *("interface", "mocap", "session", "virtual", "workflows"),
    *("test_baseline.py", "test_compare_command.py"),
)
"""Folders of tests, and files of other folders, that read the words and numbers of pages alone."""


def reads_words(path: Path) -> bool:
    """Whether no test of the file `path` looks at a figure."""
    return path.parent.name in WORDS_ALONE or path.name in WORDS_ALONE


def an_hour_later(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every clock goes an hour ahead, and no date is given from outside."""
    for name in ("time", "time_ns"):
        ahead = 3600 * (10**9 if name == "time_ns" else 1)
        now = getattr(time, name)
        monkeypatch.setattr(time, name, lambda now=now, ahead=ahead: now() + ahead)
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)


def only_html(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the layout of the PDF out where a test is not about it: it takes seconds."""

    def write_pdf(target: object, **_: object) -> None:
        Path(str(target)).write_bytes(b"%PDF-1.7\n%%EOF\n")

    document = SimpleNamespace(pages=[], write_pdf=write_pdf)
    monkeypatch.setattr("weasyprint.HTML.render", lambda *_, **__: document)


@contextmanager
def whole_pdf() -> Iterator[None]:
    """The PDF is laid out, whatever the session of tests does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("weasyprint.HTML.render", _RENDER)
        yield


def whole_pages() -> bool:
    """Whether every page of every test gets its PDF and its painted figures; it takes minutes."""
    return bool(os.environ.get("GAITVAL_WHOLE_PAGES"))


def both_pages(folder: Path) -> str:
    """The report in a run `folder` and what stands behind it, as one text of HTML."""
    names = ("report.html", "report-details.html")
    return "".join((folder / name).read_text(encoding="utf-8") for name in names)


@contextmanager
def pdf_in_ci(config: pytest.Config) -> Iterator[None]:
    """The PDF is laid out where the slow tests run: once for every kind of page."""
    with nullcontext() if only_quick_tests(config) else whole_pdf():
        yield


def only_quick_tests(config: pytest.Config) -> bool:
    """Whether the slow tests are left out, as `make test` does; CI leaves none out."""
    return bool(config.option.markexpr == "not slow")


def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures out, too, where a test is about words: they take seconds."""
    monkeypatch.setattr(
        "gaitval.reporting.page._drawings", lambda draws: dict.fromkeys(draws, Markup(EMPTY))
    )


def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw figures, with all that they should show, but do not paint them: most of the time
    goes into their outlines, which say nothing to a test of words or of a missing curve."""

    paint = Figure.savefig

    def save(figure: Figure, target: TextIO | Path | str, **options: object) -> None:
        if isinstance(target, Path | str):  # a picture of its own, and not one of a page
            paint(figure, target, **options)
            return
        for axes in figure.axes:  # labels of ticks are words, too, and made at the last moment
            axes.get_xticklabels()
            axes.get_yticklabels()
        width, height = 72.0 * figure.get_size_inches()
        target.write(
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}pt" height="{height:g}pt" '
            f'viewBox="0 0 {width:g} {height:g}"></svg>'
        )

    monkeypatch.setattr(Figure, "savefig", save)


class Page(HTMLParser):
    """Tags, links and text of a page; balanced as far as HTML asks for it."""

    VOID = frozenset({"meta", "img", "br", "link", "hr", "input"})

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.links: list[str | None] = []
        self.identifiers: list[str | None] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name in ("src", "href", "xlink:href", "srcset", "data", "action"):
                self.links.append(value)
            if name == "id":
                self.identifiers.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] != ["script"]:
            self.text += data
