"""The first page of a report: every number on it is its source's, and all of it fits."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pikepdf
import pytest
from html_page import only_html, without_figures, words_of
from report_run import build_run
from verdict_words import headline, rows_of, says

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.metrics.norms import norms
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.metrics.verdicts import limit_verdicts
from gaitval.reporting.grids import panel_name
from gaitval.reporting.report import write_report
from gaitval.reporting.sheet import FAILED_SHOWN, WARNINGS, sheet
from gaitval.subjects.subject_file import load_subject

SHEETS, WORDS = 8, 3800
KAPPA = 1.4
SMALLEST = 8.0
"""Points on paper."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("sheet")
    build_run(made)
    write_report(made)
    return made


def test_the_numbers_are_those_of_the_run(folder: Path) -> None:
    metrics, subject = read_metrics(folder), load_subject(str(folder / "subject.toml"))
    found, summary = sheet(metrics, subject), metrics.summary
    assert (found.accepted.value, found.judged.value) == (
        summary.accepted,
        summary.accepted + summary.refused,
    )
    rows = {row.name: row for row in metrics.walk.spatiotemporal}
    stance = next(row for row in found.parameters if row.label == "Stance")
    for one, side in zip(stance.of, ("right", "left"), strict=True):
        row = rows[f"stance_fraction_{side}"]
        assert one["mean"].value == pytest.approx(100.0 * row.mean)
        assert one["recorded"].value == pytest.approx(100.0 * row.recorded)
    normal = norms(subject)["parameter/stance_fraction"]
    assert found.nearer["curves"].value == summary.curves
    assert found.nearer["nearer"].value == summary.nearer
    errors = {(row.kind, row.name): row for row in found.errors}
    for row in summary.errors:
        if row.kind == "moments":
            cells = errors["moments", panel_name("moments", row.curve)]
            assert (cells.as_measured.value, cells.corrected.value) == (
                row.as_measured,
                row.corrected,
            )
            assert cells.correction.value == row.correction
    chosen = metrics.identification.rounds[-1]
    ratio = chosen.epsilon.total / chosen.floor
    assert found.learned.ratio_before == pytest.approx(ratio)
    assert found.learned.rule_met == (ratio < KAPPA)
    assert found.learned.fitted_numbers == metrics.correction.numbers
    assert stance.norm_mean.value == pytest.approx(100.0 * float(normal.mean))
    worst = next(each for each in limit_verdicts(metrics, "acceptance") if not each.passed)
    first = found.failed[0]
    assert (first.title.partition(":")[0], first.failed.value, first.all.value) == (
        worst.first.title.removesuffix(" without a model").partition(":")[0],
        len(worst.failed),
        len(worst.rows),
    )
    work = [part.joint_power.generated["ankle_angle_l"] for part in (metrics.walk, metrics.record)]
    more = 100.0 * (work[0] / work[1] - 1.0)
    assert found.push_off["left"]["more"].value == pytest.approx(more)
    known = {row.group: row for row in metrics.known_to}["sagittal angles"]
    assert found.known_to["time_step"][0][0].value == known.time_step
    for kind, lights in found.lights.items():
        for row in lights:
            assert row.lights["right"] in metrics.lights.of(kind).values()
    (*_, side) = [row for row in found.profile.rows if row.which == "walk"]
    assert side.cells[-1].value == metrics.gait_profiles.walk.left


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
    """With no text below eight points; the report has eight sheets at most, and few words."""
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
    assert words_of(tmp_path / "report.pdf") <= WORDS


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
    metrics |= {"gait_profiles": None, "identification": None, "push_recovery": None}
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
    profiles = metrics["gait_profiles"]
    profiles["variables"] = [name for name in PROFILE_ANGLES if name not in left_out]
    for score in (profiles["record"], profiles["walk"]):
        score["scores"] |= {f"{name}_{side}": 5.0 for name in PROFILE_ANGLES for side in "rl"}
    found = sheet(metrics_from(metrics, "here"), load_subject("S05")).profile
    means = [cell.value for cell in found.healthy[0]]
    assert len(means) == len(found.names) == 10 - len(left_out)
    assert (means[-1] is None) == bool(left_out)
    assert None not in means[:-1]
