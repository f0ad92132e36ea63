"""A page of a report as its tests read it."""

import shutil
import subprocess
import time
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pytest
from markupsafe import Markup

EMPTY = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="511pt" height="200pt" '
    'viewBox="0 0 511 200"></svg>'
)
"""Stands for a figure."""


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


def words_of(pdf: Path) -> int:
    """Words of the text of a PDF."""
    program = shutil.which("pdftotext")
    if program is None:
        pytest.skip("pdftotext is not installed")
    text = subprocess.run(
        [program, "-layout", str(pdf), "-"], capture_output=True, check=True, text=True
    ).stdout
    return len(text.split())


def both_pages(folder: Path) -> str:
    """The report in a run `folder` and what stands behind it, as one text of HTML."""
    names = ("report.html", "report-details.html")
    return "".join((folder / name).read_text(encoding="utf-8") for name in names)


def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures out, too, where a test is about words: they take seconds."""
    monkeypatch.setattr(
        "gaitval.reporting.page._drawings", lambda draws: dict.fromkeys(draws, Markup(EMPTY))
    )


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
