"""The first page of a report: every number on it is its source's, and all of it fits."""

import json
import re
import shutil
import tomllib
from decimal import Decimal
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pikepdf
import pytest
from html_page import only_html, without_figures
from report_run import build_run
from verdict_words import headline, rows_of, says

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.norms import norms
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.reporting.report import write_report
from gaitval.reporting.sheet import FAILED_SHOWN, WARNINGS, sheet

SHEETS = 10
WORDS = 150
"""Before the first curve."""
SMALLEST = 8.0
"""Points on paper."""
NO_SOURCE = re.compile(r"\b(one|zero)\b|V&V 40|Hicks 2015")


class Sheet(HTMLParser):
    """The cells of the sheet with their sources, its other text, and the words before a figure."""

    def __init__(self, page: str) -> None:
        super().__init__()
        start = page.index('<section class="sheet"')
        self.cells: list[tuple[dict[str, str], str]] = []
        self.rest = ""
        self.first = ""
        self._cell: dict[str, str] | None = None
        self._figure = 0
        self.feed(
            re.sub(r"<svg.*?</svg>", "", page[start : page.index("</section>", start)], flags=re.S)
        )

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        if "data-from" in named:
            self._cell = named
            self.cells.append((named, ""))
        self._figure += tag == "figure"

    def handle_endtag(self, tag):
        if tag == "span":
            self._cell = None

    def handle_data(self, data):
        if self._cell is not None:
            self.cells[-1] = (self._cell, self.cells[-1][1] + data)
        else:
            self.rest += data
        if not self._figure:
            self.first += data


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("sheet")
    build_run(made)
    write_report(made)
    return made


@pytest.fixture(scope="module")
def page(folder: Path) -> Sheet:
    return Sheet((folder / "report.html").read_text(encoding="utf-8"))


class Sources:
    """Reads the files of a run without the code that wrote the sheet."""

    def __init__(self, folder: Path) -> None:
        self.metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
        self.subject = tomllib.loads((folder / "subject.toml").read_text(encoding="utf-8"))
        self.norms = norms(load_subject(str(folder / "subject.toml")))

    def one(self, source: str):
        file, _, place = source.partition("#")
        if file == "metrics.json":
            found = self.metrics
            for part in place.split("/")[1:]:
                found = found[int(part)] if isinstance(found, list) else found[part]
            return found
        if file == "subject.toml":
            return self.subject[place]
        if file == "norms":
            name, _, which = place.rpartition("/")
            return float(getattr(self.norms[name], which)) if name in self.norms else None
        assert file == "controls"
        name, _, which = place.partition("/")
        controls = load_controls()
        if name == "people":
            return controls.people
        return (controls.side if name == "side" else controls.scores[name])[int(which)]

    def limits(self, role: str) -> dict[str, list[dict]]:
        found: dict[str, list[dict]] = {}
        for row in self.metrics["tolerances"]:
            if row["role"] == role and row["status"] != "unread":
                found.setdefault(row["id"], []).append(row)
        return found

    def counted(self, how: str) -> int:
        which, _, rest = how.partition(" ")
        kind, _, name = rest.partition(" ")
        if kind == "limits" and name:
            every = self.limits(name).values()
            return sum(which == "all" or not all(r["passed"] for r in rows) for rows in every)
        if how == "unlisted limits":
            failed = self.counted("failed limits acceptance") + self.counted(
                "failed limits context"
            )
            return max(0, failed - FAILED_SHOWN)
        if kind == "rows":
            rows = [row for row in self.metrics["tolerances"] if row["id"] == name]
            return sum(which == "all" or not row["passed"] for row in rows)
        if how == "close acceptance":
            rows = [row for each in self.limits("acceptance").values() for row in each]
            return sum(
                bool(row["passed"] and row["spread"] and row["spread"]["close"]) for row in rows
            )
        if kind == "skills":
            rows = [row for row in self.metrics["measures"] if row["measure"].endswith("_skill")]
            return sum(
                which == "all" or (row["value"] is not None and row["value"] < 0) for row in rows
            )
        assert kind == "verdicts"
        verdicts = self.metrics["identification"]["verdicts"]
        return len(verdicts) if which == "all" else verdicts.count(which)

    def value(self, cell: dict[str, str]) -> float | None:
        how = cell.get("data-how", "")
        if how not in ("", "mean", "sum", "difference", "inverse", "more"):
            return self.counted(how)
        values = [self.one(source) for source in cell["data-from"].split()]
        if None in values:
            return None
        if how == "more":
            return values[0] / values[1] - 1.0
        if how == "difference":
            return values[0] - values[1]
        if how == "inverse":
            return 1.0 / values[0]
        return sum(values) / (len(values) if how == "mean" else 1)


def test_every_number_equals_its_source(folder: Path, page: Sheet) -> None:
    sources = Sources(folder)
    assert len(page.cells) > 70
    for cell, shown in page.cells:
        value, digits = sources.value(cell), int(cell["data-digits"])
        if value is None:
            assert shown in ("–", "not measured"), cell
            continue
        value *= float(cell.get("data-scale", 1))
        text = f"{value:.{digits}f}" if digits >= 0 else _with_figures(value, -digits)
        if digits >= 0 and float(text) == 0:
            text = text.lstrip("-")
        assert shown == text.replace("-", "−"), cell


def _with_figures(value: float, figures: int) -> str:
    """At least so many figures that count, without zeros at the end and never as 1e+02."""
    rounded = Decimal(value).quantize(Decimal(1).scaleb(min(0, _place(value) - figures + 1)))
    return f"{rounded.normalize():f}"


def _place(value: float) -> int:
    """The power of ten of the first figure of a value."""
    return int(f"{value:e}".partition("e")[2])


def test_there_is_no_number_without_a_source(page: Sheet) -> None:
    """But those in names: of the trial, the person, a limit's title and the date."""
    left = NO_SOURCE.sub("", page.rest)
    for name in ("S05", "WBDS14 T05", "300 N for 50 ms within 90°", "12 to 25 Hz"):
        left = left.replace(name, "")
    left = re.sub(r"\d{4}-\d\d-\d\d( \d\d:\d\d UTC)?", "", left)
    assert not re.findall(r"\d+", left)


def test_every_light_is_that_of_the_metrics_and_has_a_reason(folder: Path, page: Sheet) -> None:
    sources, html = Sources(folder), (folder / "report.html").read_text(encoding="utf-8")
    shown = re.findall(r'class="light ([a-z-]+)" data-light="([^"]+)"', html)
    curves = sources.metrics["lights"]
    assert len(shown) == sum(len(each) for each in curves.values())
    for light, place in shown:
        assert light == sources.one(place).replace(" ", "-"), place
    said = html[html.index('class="lights-said"') :]
    said = said[: said.index("</p>")]
    doubted = {each["reason"] for of in curves.values() for each in of.values()
               if each["light"] != "believe"}  # fmt: skip
    assert doubted
    assert len(re.findall(r"\([^)]+\)", said)) >= len(doubted)


def test_a_changed_source_is_noticed(folder: Path, page: Sheet) -> None:
    sources = Sources(folder)
    sources.metrics["summary"]["accepted"] += 1
    cell = next(c for c, _ in page.cells if c["data-from"] == "metrics.json#/summary/accepted")
    shown = next(t for c, t in page.cells if c is cell)
    assert str(sources.value(cell)) != shown


def copied(folder: Path, to: Path) -> dict[str, Any]:
    """The stored metrics of a run, whose files that a report needs are put into another folder."""
    for name in ("subject.toml", "metrics.json"):
        (to / name).write_bytes((folder / name).read_bytes())
    found: dict[str, Any] = read_json(to / "metrics.json")
    return found


@pytest.mark.parametrize("kept", [False, True])
def test_the_sheet_says_what_failed_and_that_nothing_did(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    stored = copied(folder, tmp_path)
    for row in stored["tolerances"]:
        row["passed"] |= kept
    write_json(tmp_path / "metrics.json", stored)
    write_report(tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    marked, sentence = headline(page)
    assert marked is not kept
    assert says(sentence) == ("kept" if kept else "failed")
    sheet_only = page[: page.index("</section>")]
    assert 'class="verdict"' in sheet_only if kept else 'class="verdict bad"' in sheet_only
    decide = [each.failed for each in rows_of(sheet_only) if "decides" in
              [message for _, message in each.marked]]  # fmt: skip
    failed = {row["id"] for row in stored["tolerances"]
              if row["role"] == "acceptance" and not row["passed"]}  # fmt: skip
    assert decide == [True] * min(FAILED_SHOWN, len(failed))
    nothing = [e for e in rows_of(sheet_only) if len(e.cells) == 1 and says(e.cells[0])]
    assert bool(nothing) is kept
    assert all(says(each.cells[0]) == "kept" for each in nothing)


def test_a_prosthesis_and_an_aid_stand_beside_the_persons_data(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    copied(folder, tmp_path)
    about = {"prosthesis": "left", "aid": "crutches", "age_years": 31.0}
    load_subject("S05").model_copy(update=about).save(tmp_path / "subject.toml")
    write_report(tmp_path)
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "31 years, prosthesis on the left, with crutches" in re.sub(r"<[^>]*>", "", html)


PAPERS = {"a4": (595, 842), "letter": (612, 792)}


@pytest.mark.slow  # lays out a whole PDF each
@pytest.mark.parametrize("paper", PAPERS)
def test_the_sheet_is_one_page_on_every_paper(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, paper: str
) -> None:
    """With no text below eight points; the report has ten pages at most, none of them empty."""
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    write_report(tmp_path, [f"report.paper={paper}"])
    with pikepdf.open(tmp_path / "report.pdf") as document:
        first, second = document.pages[:2]
        edges = [float(edge) for edge in first.mediabox]
        assert edges == pytest.approx([0, 0, *PAPERS[paper]], abs=1)
        sizes = list(_sizes(first))
        assert len(sizes) > 100
        assert min(sizes) >= SMALLEST - 0.05
        with document.open_outline() as outline:
            place = outline.root[0].children[0].destination
        assert place[0].objgen == second.obj.objgen, "the first heading is not on the second page"
        assert len(document.pages) <= SHEETS


def _sizes(page):
    """Size in points of each text that a page shows, with those of its pictures."""

    def walk(stream, scale, resources):
        matrix, stack, size = scale, [], 0.0
        for operands, operator in pikepdf.parse_content_stream(stream):
            match str(operator):
                case "q":
                    stack.append(matrix)
                case "Q":
                    matrix = stack.pop()
                case "cm":
                    a, b, c, d, *_ = map(float, operands)
                    matrix *= abs(a * d - b * c) ** 0.5
                case "Tf":
                    size = float(operands[1])
                case "Tm":
                    a, b, c, d, *_ = map(float, operands)
                    text = abs(a * d - b * c) ** 0.5
                case "Tj" | "TJ":
                    yield size * text * matrix
                case "Do":
                    inner = resources.XObject[operands[0]]
                    if inner.get("/Subtype") == "/Form":
                        turn = [float(each) for each in inner.get("/Matrix", [1, 0, 0, 1, 0, 0])]
                        grown = abs(turn[0] * turn[3] - turn[1] * turn[2]) ** 0.5
                        yield from walk(inner, matrix * grown, inner.get("/Resources", resources))

    yield from walk(page, 1.0, page.Resources)


def test_the_gravest_doubts_come_first_and_three_at_most(folder: Path) -> None:
    found = read_metrics(folder / "metrics.json")
    subject = load_subject(str(folder / "subject.toml"))
    kinds = [each.kind for each in sheet(found, subject).warnings]
    assert len(kinds) == WARNINGS
    assert kinds[0] == "narrow"


def test_a_run_without_much_has_a_sheet_all_the_same(tmp_path: Path) -> None:
    build_run(tmp_path)
    metrics = json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"))
    metrics |= {"curve_statistics": None, "identification": None, "push_recovery": None}
    metrics |= {"second_engine": None, "predictions": []}
    write_json(tmp_path / "metrics.json", metrics)
    found = sheet(read_metrics(tmp_path / "metrics.json"), load_subject("S05"))
    assert found.profile is None
    assert set(found.lights) == {"angles", "moments", "forces"}


@pytest.mark.parametrize("left_out", [(), ("foot_progression",)])
def test_a_score_of_fewer_angles_is_not_beside_the_healthy_score_of_nine(
    folder: Path, left_out: tuple[str, ...]
) -> None:
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    profiles = metrics["curve_statistics"]["profiles"]
    profiles["variables"] = [name for name in PROFILE_ANGLES if name not in left_out]
    for score in (profiles["record"], profiles["walk"]):
        score["scores"] |= {f"{name}_{side}": 5.0 for name in PROFILE_ANGLES for side in "rl"}
    found = sheet(metrics_from(metrics, "here"), load_subject("S05")).profile
    means = [cell.value for cell in found.healthy[0]]
    assert len(means) == len(found.names) == 10 - len(left_out)
    assert (means[-1] is None) == bool(left_out)
    assert None not in means[:-1]
