"""The body by the standing trial: sides, ankles and widths that people have, and others."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.findings import look
from gaitval.findings.standing import DISTANCES, StandingBody
from gaitval.scaling.scaling import scale_subject
from gaitval.scaling.segments import ScaledSegment
from gaitval.subjects.subject_file import BUILTIN, load_subject

NO_WIDTHS = {"knee width": None, "ankle width": None}


def body(identifier, **changed):
    subject = load_subject(identifier)
    points = {name: np.asarray(at) for name, at in subject.markers.items()}
    return StandingBody(
        points, scale_subject(subject).table, NO_WIDTHS, subject.height_m, **changed
    )


def seen(of):
    return {flag.where: flag for flag in look(of).flags if flag.check == "sides that differ"}


@pytest.mark.parametrize("identifier", BUILTIN)
def test_nobody_of_ten_has_such_sides(identifier):
    assert not seen(body(identifier))


@pytest.mark.parametrize(
    ("marker", "away", "where"),
    [
        ("Ankle", (0.0, 0.015, 0.0), "Ankle to Ankle.Medial"),
        ("Ankle", (0.03, 0.0, 0.0), "Heel to Ankle"),
        ("ASIS", (0.0, 0.02, 0.015), "ASIS to other PSIS"),
        ("ASIS", (0.0, 0.0, 0.028), "ASIS above PSIS"),
        ("Heel", (0.0, 0.0, 0.022), "Heel above the floor"),
        ("MT5", (0.0, 0.0, 0.018), "MT5 above the floor"),
    ],
)
def test_a_marker_that_is_misplaced_in_all_trials_is_seen_beside_the_other_side(
    marker, away, where
):
    """`away` is forward, outwards, up, m."""
    of = body("S05")
    points = of.points
    forward = (points["L.MT1"] - points["L.Heel"]) * [1.0, 1.0, 0.0]
    forward = forward / np.linalg.norm(forward)
    axes = np.array([forward, np.cross([0.0, 0.0, 1.0], forward), [0.0, 0.0, 1.0]])
    points[f"L.{marker}"] = points[f"L.{marker}"] + np.array(away) @ axes
    flag = seen(of)[where]
    assert flag.value > flag.limit
    if where == "Ankle to Ankle.Medial":
        assert flag.limit == DISTANCES["Ankle", "Ankle.Medial"]
        width = 1000 * np.linalg.norm(points["L.Ankle"] - points["L.Ankle.Medial"])
        assert f"{width:.0f} mm on the left" in flag.message
    if where.endswith("the floor"):  # a pose put together from the walk has no floor
        assert where not in seen(replace(of, stood=False))


def test_a_front_spine_that_is_far_from_the_sacrum():
    of = body("S05")
    of.points["Sacrum"] = (of.points["R.PSIS"] + of.points["L.PSIS"]) / 2
    assert not seen(of)
    of.points["R.ASIS"] = of.points["R.ASIS"] + [0.03, 0.0, 0.0]
    assert "ASIS to Sacrum" in seen(of)


def test_a_foot_on_its_toes_has_no_misplaced_marker():
    of = body("S02")
    for marker in ("Heel", "Ankle", "Ankle.Medial"):
        of.points[f"L.{marker}"] = of.points[f"L.{marker}"] + [0.0, 0.0, 0.03]
    assert not [where for where in seen(of) if "above the floor" in where]


def row(segment, **values):
    (found,) = (row for row in body("S05").lengths if row.segment == segment)
    return replace(found, **values)


@pytest.mark.parametrize(
    ("given", "check", "value"),
    [
        (row("ankle height", factor=1.7), "ankle height", 1.7),
        (row("shank", right_m=0.40, left_m=0.37), "legs that differ", 0.03),
        (row("forearm", right_m=0.30, left_m=0.26), None, None),
        ({"knee width": 0.16, "ankle width": None}, "widths", 0.16 / 1.7),
        ({"knee width": None, "ankle width": (0.1, 0.1)}, "widths", 0.1 / 1.7),
        ({"knee width": 0.1, "ankle width": 0.07}, None, None),
    ],
)
def test_rare_lengths_and_widths_are_told(given, check, value):
    if isinstance(given, ScaledSegment):
        of = StandingBody({}, [given], NO_WIDTHS, 1.7)
    else:
        of = StandingBody({}, [], given, 1.7)
    flags = look(of).flags
    assert [flag.check for flag in flags] == ([] if check is None else [check])
    assert check is None or flags[0].value == pytest.approx(value)
