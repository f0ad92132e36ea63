"""The page of a history: steps by commit, text from outside as text, all values as CSV."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from html_page import Page, only_html, pdf_in_ci
from seen_figures import figures_of
from verdict_words import rows_of

from gaitval.apps.regression.history import Check, CheckedFigure
from gaitval.apps.regression.history_page import find_steps, write_history

HOSTILE = "<script>alert(1)</script>$x^2$ \\n --> {{ 7 * 7 }}"
WORSE_AT, SMALL_AT, COUNT = 8, 5, 12


def figure(target: str, value: float | None, *, better: str = "lower") -> CheckedFigure:
    return CheckedFigure("angle_rmse", target, "deg", value, 1.0, 0.3, better)


def checks() -> list[Check]:
    """Twelve commits: the right knee gets worse by twice its margin at one, the left one by a third
    of it at another; the hip never changes; a benchmark gets faster on one of two machines."""
    random = np.random.default_rng(0)
    found = []
    for number in range(COUNT):
        revision = f"{number:02d}" * 20
        day = f"2026-11-{number + 1:02d}T10:00:00+00:00"
        noise = 0.01 * random.normal(size=2)
        figures = (
            figure("knee_angle_r", 1.0 + 0.6 * (number >= WORSE_AT) + noise[0]),
            figure("knee_angle_l", 1.0 + 0.1 * (number >= SMALL_AT) + noise[1]),
            figure("hip_flexion_r", 1.0),
        )
        found.append(Check("check", revision, day, day, "m1", "S05", figures))
        for machine in ("m1", "m2"):
            seconds = 1.0 + 0.001 * random.normal() - 0.5 * (machine == "m2" and number >= 6)
            times = (CheckedFigure("benchmark", "b.py::test_a", "s", seconds, None, None, "lower"),)
            found.append(Check("benchmark", revision, day, day, machine, "", times))
    return found


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("history")
    with pdf_in_ci(request.config):
        write_history(found, "accuracy", checks())
    return found


def test_steps_are_found_at_their_commits_and_held_against_the_margin() -> None:
    found = {(step.subject, step.target, step.machine): step for step in find_steps(checks())}
    assert len(found) == 3
    worse = found["S05", "knee_angle_r", ""]
    assert (worse.revision[:2], worse.last[:2], worse.change) == ("08", "07", "worse")
    assert worse.before is not None
    assert worse.after == pytest.approx(worse.before + 0.6, abs=0.02)
    assert found["S05", "knee_angle_l", ""].change == "within the margin"
    assert found["S05", "knee_angle_l", ""].revision[:2] == "05"
    faster = found["", "b.py::test_a", "m2"]
    assert (faster.revision[:2], faster.change) == ("06", "better")


def test_better_may_be_higher() -> None:
    turned = [
        replace(
            check,
            figures=tuple(replace(each, better="higher", margin=0.3) for each in check.figures),
        )
        for check in checks()
    ]
    found = {step.target: step.change for step in find_steps(turned)}
    assert found == {
        "knee_angle_r": "better", "knee_angle_l": "within the margin", "b.py::test_a": "worse",
    }  # fmt: skip


def test_what_could_not_be_measured_is_left_out_of_the_search() -> None:
    some = checks()
    some[0] = replace(some[0], figures=(figure("knee_angle_r", None), *some[0].figures[1:]))
    assert find_steps(some)[-1].revision[:2] in ("06", "08")


def test_a_figure_that_is_no_longer_measured_is_a_loss_at_its_commit(tmp_path: Path) -> None:
    """A walk that falls has no figures: nothing of it scatters, and yet it is worse than all."""
    kept = [each for each in checks() if each.kind == "check"]
    fallen = [
        replace(each, figures=tuple(replace(one, value=None) for one in each.figures))
        if number in (7, 8)
        else each
        for number, each in enumerate(kept)
    ]
    hips = [each for each in find_steps(fallen) if each.target == "hip_flexion_r"]
    assert [(each.revision[:2], each.last[:2], each.change) for each in hips] == [
        ("07", "06", "worse"),
        ("09", "08", "better"),
    ]
    assert [(each.before, each.after) for each in hips] == [(1.0, None), (None, 1.0)]
    # in the first checks, too, where no scatter is known
    found = write_history(tmp_path, "short", fallen[5:8])
    assert {(each.revision[:2], each.change) for each in found} == {("07", "worse")}
    page = (tmp_path / "short.html").read_text(encoding="utf-8")
    assert "not measured" in page
    assert "Too few checks" not in page


def test_each_step_says_which_way_it_went(folder: Path) -> None:
    page = (folder / "accuracy.html").read_text(encoding="utf-8")
    rows = {each.cells[0]: each for each in rows_of(page) if len(each.cells) == 10}
    messages = {name: (each.cells[-1], each.failed, each.marked) for name, each in rows.items()}
    assert messages == {
        "08080808": ("worse", True, [("fail", "worse")]),
        "05050505": ("within the margin", False, []),
        "06060606": ("better", False, []),
    }
    before, after = (float(each) for each in rows["08080808"].cells[4:6])
    assert after - before == pytest.approx(0.6, abs=0.02)


def test_the_page_tells_the_steps_and_draws_what_changed(folder: Path) -> None:
    html = (folder / "accuracy.html").read_text(encoding="utf-8")
    page = Page(html)
    assert page.open == []
    assert page.tags.count("script") == 1  # what copies tables
    text = " ".join(page.text.split())
    assert re.search(r"08080808 ?07070707 ?S05 ?angle rmse right knee flexion", text)
    assert "worse" in text
    assert "within the margin" in text
    assert "stroke-dasharray: 1,1.5" in html  # without a step: told apart without colours
    assert page.tags.count("svg") == 3  # the subject, and the benchmark on two machines
    assert f"{5 - 4} of 5 figures never changed" in text
    assert len(re.findall(r"2026-11-\d\d 10:00", text)) == 3 * COUNT
    assert page.links[-1] == "accuracy.csv" or "accuracy.csv" in page.links


def test_the_csv_has_every_value(folder: Path) -> None:
    with (folder / "accuracy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == COUNT * 5
    knee = [row for row in rows if row["target"] == "knee_angle_r"]
    wanted = [check.figures[0].value for check in checks() if check.kind == "check"]
    assert [float(row["value"]) for row in knee] == wanted
    assert {row["margin"] for row in knee} == {"0.3"}


def test_text_from_outside_stays_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    hostile = [
        replace(
            check,
            revision=HOSTILE,
            machine=HOSTILE,
            subject=HOSTILE if check.subject else "",
            figures=tuple(
                replace(each, measure=HOSTILE + each.measure, target="=" + HOSTILE, unit=HOSTILE)
                for each in check.figures[:1]
            ),
        )
        for check in checks()
    ]
    write_history(tmp_path, "a<b>", hostile)
    html = (tmp_path / "a<b>.html").read_text(encoding="utf-8")
    page = Page(html)
    assert page.tags.count("script") == 1  # what copies tables
    assert "b" not in page.tags
    assert html.count("<script>") == 1
    assert "{{ 7 * 7 }}" in page.text
    with (tmp_path / "a<b>.csv").open(newline="") as file:
        assert all(row["target"].startswith("'=") for row in csv.DictReader(file))


def test_too_few_checks_are_said_to_be_too_few(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    assert write_history(tmp_path, "few", checks()[:12]) == []
    text = Page((tmp_path / "few.html").read_text(encoding="utf-8")).text
    assert "here the longest series has 4" in " ".join(text.split())
    first = [replace(each, revision="unknown", revised=None) for each in checks()[:1]]
    assert write_history(tmp_path, "one", first) == []
    one = " ".join(Page((tmp_path / "one.html").read_text(encoding="utf-8")).text.split())
    assert "git repository" in one
    assert "there is 1" in one
    assert "unknown" not in one
    assert write_history(tmp_path, "none", []) == []


def test_values_are_drawn_at_their_commits_and_steps_before_theirs(tmp_path: Path) -> None:
    some = checks()
    drawn = figures_of(lambda: write_history(tmp_path, "a", some))
    knees = drawn[0].axes[0]
    assert knees.get_title(loc="left") == "angle rmse, deg"
    assert knees.get_xlim()[0] < knees.get_xlim()[1]
    series = {tuple(line.get_ydata()): list(line.get_xdata()) for line in knees.lines
              if len(line.get_xdata()) == COUNT}  # fmt: skip
    of_checks = [each for each in some if each.kind == "check"]
    for number in (0, 1):
        values = tuple(each.figures[number].value for each in of_checks)
        assert series[values] == list(range(COUNT))
    upright = {line.get_xdata()[0]: line for line in knees.lines if len(line.get_xdata()) == 2}
    assert set(upright) == {WORSE_AT - 0.5, SMALL_AT - 0.5}
    assert upright[WORSE_AT - 0.5].get_linestyle() == "-"  # solid where it got worse
    assert upright[SMALL_AT - 0.5].get_linestyle() != "-"
    labels = [each.get_text() for each in knees.get_xticklabels()]
    assert labels == ["00000000", "11111111"]
