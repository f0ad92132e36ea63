"""The report of many walks: its numbers are those of the metrics, text from outside stays text."""

import csv
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from html_page import Page, only_html, without_figures
from seen_figures import figure_of, forward, lines
from verdict_words import plain, rows_of

from gaitval._internal.text.number_text import number
from gaitval.apps.regression import comparison_page
from gaitval.apps.regression.comparison_page import SUBJECTS, write_comparison
from gaitval.apps.regression.versions import StoredWalk, matched
from gaitval.coordinates import SIDES
from gaitval.metrics.baselines import GROUPS, group_rows
from gaitval.metrics.results import Metrics, metrics_from, read_metrics
from gaitval.metrics.walk_quantities import quantities_of_record, quantities_of_walk
from gaitval.quantities import QUANTITIES
from gaitval.reporting.figures import COLOURS, RECORD_COLOUR

REPORTS = Path(__file__).parents[2] / "reports"
HOSTILE = "<script>alert('x')</script>{{ 7 * 7 }}"


@cache
def stored(name: str) -> Metrics:
    """Of a stored baseline; none of the tests changes it in place."""
    return read_metrics(REPORTS / name / "baseline")


def walk(name: str, folder: str = "runs") -> StoredWalk:
    return StoredWalk(
        folder=Path(folder) / name,
        metrics=stored(name),
        margins=None,
    )


def changed(walk: StoredWalk, **by: float) -> StoredWalk:
    """The walk with the values of some measures changed."""
    rows = [
        row.model_copy(update={"value": row.value + by.get(row.measure, 0.0)})
        for row in walk.metrics.measures
    ]
    return replace(walk, metrics=walk.metrics.model_copy(update={"measures": rows}))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("comparison")
    walks = [changed(walk("S05", "new"), epsilon=0.5), changed(walk("S02", "new"), epsilon=-0.1)]
    versions = matched([walk("S02", "old"), walk("S05", "old"), walk("S03", "old")], walks)
    write_comparison(found, "comparison", walks, versions)
    return found


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return Page((folder / "comparison.html").read_text(encoding="utf-8"))


def test_the_page_is_whole_and_needs_nothing_else(page: Page, folder: Path) -> None:
    assert page.open == []
    assert not {"link", "iframe", "object"} & set(page.tags)
    beside = {link for link in page.links if not link.startswith("#")}
    assert beside == {"comparison.csv", "comparison_curves.csv", "comparison_figures.csv"}
    assert all((folder / name).is_file() for name in beside)
    assert len(page.identifiers) == len(set(page.identifiers))
    assert page.tags.count("svg") == 9  # a drawing of each curve
    assert (folder / "comparison.pdf").read_bytes().startswith(b"%PDF")


def test_what_got_worse_stands_before_what_improved(page: Page) -> None:
    text = " ".join(page.text.split())
    assert "No walk now of S03" in text
    assert "of the walks from each start phase, in the compiled engine" in text
    assert "1 of 354 measures got worse by more than their margin, 1 better" in text
    worse, better = text.index("S05epsilon"), text.index("S02epsilon")
    assert worse < better
    before = next(row.value for row in walk("S05").metrics.measures if row.measure == "epsilon")
    assert f"{before:.4g}{before + 0.5:.4g}10.0150.0worse" in text


@pytest.mark.slow
def test_each_row_says_worse_or_better_of_its_own_change(folder: Path) -> None:
    rows = rows_of((folder / "comparison.html").read_text(encoding="utf-8"))
    messages = {
        each.cells[0]: (each.failed, each.marked) for each in rows
        if each.cells[-1:] in (["worse"], ["better"])
    }  # fmt: skip
    assert messages == {
        "S05": (True, [("fail", "worse")]), "S02": (False, [("pass", "better")]),
    }  # fmt: skip
    pairs = {each.cells[0]: each for each in rows if len(each.cells) == 6}
    assert [pairs["S05"].cells[1:3], pairs["S02"].cells[1:3]] == [["1", "0"], ["0", "1"]]
    assert [pairs["S05"].failed, pairs["S02"].failed] == [True, False]


def test_the_errors_are_those_of_each_subject(page: Page) -> None:
    rows = [group_rows(walk(name).metrics) for name in ("S05", "S02")]
    text = " ".join(page.text.split())
    for row in (each for rows_of_one in rows for each in rows_of_one):
        skill = next(iter(row.skills().values()))
        digits = 3 if row.unit == "Nm/kg" else 2
        assert f"{number(row.walked, digits)}{number(skill, 2)}" in text
    angles = [each[0].walked for each in rows]
    mean, sd = np.mean(angles), np.std(angles, ddof=1)
    assert f"{number(mean, 2)} ± {number(sd, 2)}" in text


def test_the_tables_beside_have_every_value(folder: Path) -> None:
    with (folder / "comparison.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 177
    moved = {(row["subject"], row["measure"]): row for row in rows if row["change"] != "kept"}
    assert set(moved) == {("S05", "epsilon"), ("S02", "epsilon")}
    assert moved["S05", "epsilon"]["change"] == "lost"
    assert {row["comparison"] for row in rows} == {"fitted", "not compared"}
    with (folder / "comparison_curves.csv").open(newline="") as file:
        curves = list(csv.DictReader(file))
    quantities = sum(len(each.curves) for name in ("S05", "S02")
                     for each in quantities_of_walk(stored(name).walk).values())  # fmt: skip
    assert len(curves) == (2 * 32 + quantities) * 101
    metrics = walk("S05").metrics
    recorded = metrics.record.curves.moments["knee_angle_l"]
    mine = [
        float(row["recorded"]) for row in curves
        if (row["walk"], row["quantity"], row["side"]) == ("S05", "knee_angle moment", "left")
    ]  # fmt: skip
    assert mine == recorded
    assert {row["before"] == row["simulated"] for row in curves} == {True}
    power = quantities_of_record(metrics.record)["power"].curves["ankle_angle_l"]
    mine = [
        float(row["recorded"]) for row in curves
        if (row["walk"], row["quantity"], row["side"]) == ("S05", "ankle_angle power", "left")
    ]  # fmt: skip
    np.testing.assert_allclose(mine, power)


def test_every_table_of_every_quantity_has_each_walk(folder: Path) -> None:
    """Metabolic rates among them: a new quantity comes by itself."""
    text = (folder / "comparison.html").read_text(encoding="utf-8")
    rows = rows_of(text)
    with (folder / "comparison_figures.csv").open(newline="") as file:
        figures = list(csv.DictReader(file))
    walked = {name: quantities_of_walk(stored(name).walk) for name in ("S05", "S02")}
    for quantity in QUANTITIES:
        for table in quantity.tables:
            for label, kind, name in table.rows:
                shown: dict[str, list[float | None]] = {}
                for side in SIDES:
                    values = [
                        walked[who][quantity.name].figures.get(kind, {}).get(f"{name}_{side[0]}")
                        for who in ("S05", "S02")
                    ]
                    shown[side] = values
                    for who, value in zip(("S05", "S02"), values, strict=True):
                        key = (who, quantity.name, kind, name, side)
                        of = ("walk", "quantity", "figure", "of", "side")
                        (row,) = [r for r in figures if tuple(r[each] for each in of) == key]
                        assert row["simulated"] == row["before"]
                        assert row["unit"] == quantity.figures[kind]
                        if value is not None:
                            assert float(row["simulated"]) == pytest.approx(value, rel=1e-5)
                if table.of_body:
                    pairs = zip(*shown.values(), strict=True)
                    shown = {"body": [0.5 * (one + other) for one, other in pairs]}
                for column, values in shown.items():
                    cells = [
                        f"{each} ({each})" for each in (number(v, table.digits) for v in values)
                    ]
                    if values != [None, None]:
                        assert [label, column, *cells] in [each.cells for each in rows], cells
    assert "Metabolic rate, from joints, W/kg" in text
    assert "of the walk before" in text


def test_without_a_walk_before_figures_are_beside_those_of_the_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    write_comparison(tmp_path, "comparison", [walk("S05")], None)
    rows = rows_of((tmp_path / "comparison.html").read_text(encoding="utf-8"))
    metrics = stored("S05")
    found = [
        np.mean([each["metabolic_joints"].figures["gross"][f"body_{side}"] for side in "rl"])
        for each in (quantities_of_walk(metrics.walk), quantities_of_record(metrics.record))
    ]
    now, recorded = (number(each, 2) for each in found)
    assert ["Gross", "body", f"{now} ({recorded})"] in [each.cells for each in rows]
    muscles = [each.cells for each in rows if each.cells[:2] == ["Umberger 2010", "body"]]
    assert [cells[2].endswith("(–)") for cells in muscles] == [True]


def test_names_from_outside_stay_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    found = walk("S05", HOSTILE)
    values = found.metrics.as_dict()
    values["subject"] = {name: f"={HOSTILE}" for name in values["subject"]}
    hostile = replace(found, metrics=metrics_from(values, "here"))
    write_comparison(tmp_path, "c", [hostile, hostile], None)
    html = (tmp_path / "c.html").read_text(encoding="utf-8")
    assert html.count("<script") == 1  # what copies tables
    text = Page(html).text
    assert "{{ 7 * 7 }}" in text
    assert "What got worse" not in text
    assert f"={HOSTILE} ({HOSTILE}/S05)" in " ".join(text.split())
    with (tmp_path / "c.csv").open(newline="") as file:
        assert all(row["walk"].startswith("'=") for row in csv.DictReader(file))


def test_a_walk_that_fell_at_once_has_dashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    found = walk("S05")
    values = found.metrics.as_dict()
    walked = values["walks"][values["final"]]
    nothing = {kind: dict.fromkeys(errors) for kind, errors in walked["errors"].items()}
    empty = {
        kind: {name: {"mean": None, "sd": None} for name in errors}
        for kind, errors in nothing.items()
    }
    walked |= {"errors": nothing, "curves": empty}
    values["measures"] = [row | {"value": None} for row in values["measures"]]
    values["push_recovery"] = None
    now = replace(found, metrics=metrics_from(values, "here"))
    write_comparison(tmp_path, "c", [now], matched([walk("S05", "old")], [now]))
    text = " ".join(Page((tmp_path / "c.html").read_text(encoding="utf-8")).text.split())
    assert "177 of 177 measures got worse" in text
    assert "and 117 more" in text.lower()
    assert "not measured" in text


@pytest.mark.slow  # a page of many people
def test_many_walks_are_shared_out_over_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    walks = [walk("S05", f"run{number}") for number in range(SUBJECTS + 1)]
    write_comparison(tmp_path, "c", walks, None)
    page = Page((tmp_path / "c.html").read_text(encoding="utf-8"))
    assert page.tags.count("svg") == 2 * 9
    assert "S05 (run10/S05)" in page.text


def test_who_walked_twice_counts_once_in_the_mean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    walks = [walk("S05", "one"), walk("S05", "two"), walk("S02")]
    write_comparison(tmp_path, "c", walks, None)
    text = " ".join(Page((tmp_path / "c.html").read_text(encoding="utf-8")).text.split())
    assert "mean ± SD, fitted, 2 people (3 walks, those of one person averaged first)" in text
    errors = [group_rows(walk(name).metrics)[0].walked for name in ("S05", "S02")]
    assert f"{number(np.mean(errors), 2)} ± {number(np.std(errors, ddof=1), 2)}" in text
    write_comparison(tmp_path, "d", walks[:2], None)
    assert "mean ± SD" not in (tmp_path / "d.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("kind", "name"), comparison_page.CURVES)
def test_curves_of_each_walk_are_its_own_by_side(kind: str, name: str) -> None:
    now, then = walk("S05"), walk("S02")
    names = [now.subject, then.subject]
    figure = figure_of(
        lambda: comparison_page._panels([now, then], names, kind, name, {id(now): then}, 0)
    )
    for axes, one, before in zip(figure.axes, (now, then), (then, None), strict=True):
        assert forward(axes)
        assert axes.get_title(loc="left") == one.subject
        for side, colour in COLOURS.items():
            key = f"{name}_{side[0]}"
            expected = [one.metrics.walk.curves.of(kind)[key].mean]
            if before is not None:
                expected.insert(0, before.metrics.walk.curves.of(kind)[key].mean)
            shown = [line[:, 1] for line in lines(axes, colour)]
            np.testing.assert_allclose(shown, expected)
            assert [line[0, 0] for line in lines(axes, colour)] == [0.0] * len(expected)
        recorded = [one.metrics.record.curves.of(kind)[f"{name}_{side}"] for side in "rl"]
        np.testing.assert_allclose([e[:, 1] for e in lines(axes, RECORD_COLOUR)], recorded)


def told_angles(found: StoredWalk) -> StoredWalk:
    """The walk as of a model that was told the angles alone."""
    told = {kind: kind == "angles" for kind in found.metrics.known}
    return replace(found, metrics=found.metrics.model_copy(update={"known": told}))


def test_walks_of_one_person_are_named_by_what_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    write_comparison(tmp_path, "c", [walk("S05", "a"), told_angles(walk("S05", "b"))], None)
    html = (tmp_path / "c.html").read_text(encoding="utf-8")
    text = " ".join(Page(html).text.split())
    assert "1: S05 (told all)" in text
    assert "2: S05 (told angles)" in text
    assert "a/S05)" not in text  # what they differ in is enough


def test_a_mean_is_never_of_fitted_and_held_out_curves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    walks = [walk("S05"), walk("S02"), told_angles(walk("S06")), told_angles(walk("S07"))]
    write_comparison(tmp_path, "c", walks, None)
    html = (tmp_path / "c.html").read_text(encoding="utf-8")
    rows = [
        [plain(each) for each in re.findall(r"<th.*?>(.*?)</th>", row, re.S)]
        for row in re.findall(r'<tr class="group">(.*?)</tr>', html, re.S)
    ]
    assert len(rows) == 2
    place = list(GROUPS).index("vertical force")
    vertical = [group_rows(each.metrics)[place].walked for each in walks]
    assert "fitted, 4 people" in rows[0][0]  # all four of the angles
    assert rows[0][place + 1] == f"{number(np.mean(vertical[:2]), 2)} ± " + (
        f"{number(np.std(vertical[:2], ddof=1), 2)} (2)"
    )
    assert "held out, 2 people" in rows[1][0]
    assert rows[1][1] == "–"
    assert rows[1][place + 1].startswith(number(np.mean(vertical[2:]), 2))
