"""docs/how-to/extend.md#add-a-verdict: what it shows is all that a new verdict takes."""

import json
import re
from pathlib import Path

import pytest
from followed_page import blocks_of, followed, ran
from html_page import both_pages

PAGE = "extend.md#add-a-verdict"
TITLE = "Largest knee flexion of swing"
STIFF = 8.0
"""Degrees that the right knee bends less than the recorded one."""

WALK = f"""
from dataclasses import replace
from pathlib import Path
import numpy as np
from synthetic_walk import MODEL, perfect_walk, sharp_filter, walks_of
from gaitval._internal.io.artefacts import write_json
from gaitval.coordinates import COORDINATES
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.metrics.validation import validate
from gaitval.reporting import page, report

subject, configuration = load_subject("S05"), sharp_filter()
record = subject.record()
walk = perfect_walk(record, cycles=6)
positions = walk.positions.copy()
positions[:, COORDINATES.index("knee_angle_r")] -= np.deg2rad({STIFF})
walks = walks_of([replace(walk, positions=positions)], configuration)
metrics = validate(subject, record, MODEL, walks, None, configuration, others=builtin_subjects())
Path("run").mkdir()
Path("run/subject.toml").write_text(subject.to_toml(), encoding="utf-8")
write_json(Path("run/metrics.json"), metrics.as_dict())
page.print_page = lambda *_: None  # figures and PDF take seconds, and have no verdict
draw = report._drawings
report._drawings = lambda *given: dict.fromkeys(draw(*given), str)
report.write_report(Path("run"))
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package in which the page was followed, and a walk there."""
    folder = followed(PAGE, tmp_path_factory.mktemp("changed"))
    (folder / "said").write_text(ran(folder, "-c", WALK), encoding="utf-8")
    return folder


def test_it_touches_two_files() -> None:
    assert len({block.file for block in blocks_of(PAGE)}) == 2


def test_metrics_have_it(place: Path) -> None:
    metrics = json.loads((place / "run/metrics.json").read_text(encoding="utf-8"))
    rows = {row["target"]: row for row in metrics["tolerances"] if row["id"] == "swing-knee"}
    assert rows["right"]["value"] == pytest.approx(STIFF, abs=0.2)
    assert rows["left"]["value"] < 0.2
    assert [rows[side]["passed"] for side in ("right", "left")] == [False, True]
    (row,) = (
        row
        for row in metrics["measures"]
        if (row["measure"], row["target"]) == ("swing_knee_error", "right")
    )
    assert (row["unit"], row["comparison"], row["origin"]) == ("deg", "fitted", "recorded")


def test_the_page_has_it(place: Path) -> None:
    assert (place / "run/report.html").is_file(), (place / "said").read_text(encoding="utf-8")
    html = both_pages(place / "run")
    assert re.search(rf'<tr class="failed"><td>(?:<span>)?{TITLE}<', html)
    assert "right: 8" in html


@pytest.mark.slow
def test_python_has_it(place: Path) -> None:
    code = (
        "import gaitval as gv; limits = gv.limits()\n"
        "print(limits.to_frame().set_index('measure').loc['swing_knee_error', 'quantity'])"
    )
    assert TITLE in ran(place, "-c", code)
