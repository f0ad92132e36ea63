"""A marker misplaced in all trials alike is seen beside the other leg's."""

import numpy as np
import pytest

from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.session.odd_sides import SIDES_DIFFER, odd_sides


def points(identifier: str) -> dict[str, np.ndarray]:
    return {name: np.asarray(at) for name, at in load_subject(identifier).markers.items()}


@pytest.mark.parametrize("identifier", BUILTIN)
def test_nobody_of_ten_has_such_legs(identifier):
    assert not list(odd_sides(points(identifier)))


@pytest.mark.parametrize(("marker", "side"), [("Ankle", "L"), ("Ankle.Medial", "R")])
def test_a_malleolus_15_mm_outwards_is_named_with_both_widths(marker, side):
    found = points("S05")
    out = found[f"{side}.{marker}"] - (found[f"{side}.Ankle"] + found[f"{side}.Ankle.Medial"]) / 2
    found[f"{side}.{marker}"] = found[f"{side}.{marker}"] + 0.015 * out / np.linalg.norm(out)
    flags = {flag.where: flag for flag in odd_sides(found)}
    flag = flags["Ankle to Ankle.Medial"]
    assert flag.value > flag.limit == SIDES_DIFFER["Ankle", "Ankle.Medial"]
    for each in "RL":
        width = 1000 * np.linalg.norm(found[f"{each}.Ankle"] - found[f"{each}.Ankle.Medial"])
        assert f"{width:.0f} mm on the {'right' if each == 'R' else 'left'}" in flag.message


def test_a_malleolus_20_mm_ahead_is_seen_from_the_heel():
    found = points("S05")
    ahead = found["L.Ankle"] - found["L.Heel"]
    found["L.Ankle"] = found["L.Ankle"] + 0.022 * ahead / np.linalg.norm(ahead)
    assert "Heel to Ankle" in {flag.where for flag in odd_sides(found)}


def test_without_medial_markers_nothing_is_said_of_widths():
    found = {name: at for name, at in points("S05").items() if "Medial" not in name}
    found["L.Knee"] = found["L.Knee"] + [0.0, 0.03, 0.0]
    assert not list(odd_sides(found))


@pytest.mark.parametrize(("identifier", "side"), [("S01", "R"), ("S05", "L"), ("S10", "R")])
def test_a_knee_marker_18_mm_back_in_all_trials_is_seen(identifier, side):
    """Across the line of the epicondyles it changes no width."""
    found = points(identifier)
    line = found[f"{side}.Knee"] - found[f"{side}.Knee.Medial"]
    back = np.cross([0.0, 0.0, 1.0], line) * (1 if side == "R" else -1)
    found[f"{side}.Knee"] = found[f"{side}.Knee"] + 0.018 * back / np.linalg.norm(back)
    (flag,) = odd_sides(found)
    assert flag.where == "Knee to Knee.Medial"
    assert flag.unit == "deg"
    assert 7.5 < flag.value < 16.0


@pytest.mark.parametrize("identifier", ["S01", "S05", "S08"])
def test_a_spine_20_mm_out_and_15_mm_up_in_all_trials_is_seen(identifier):
    found = points(identifier)
    out = found["L.ASIS"] - found["R.ASIS"]
    found["L.ASIS"] = found["L.ASIS"] + 0.02 * out / np.linalg.norm(out) + [0.0, 0.0, 0.015]
    flags = [flag for flag in odd_sides(found) if "ASIS" in flag.where]
    assert len(flags) == 1
    # no marker is on spines that were estimated from the crests
    assert not list(odd_sides(found, ("R.ASIS", "L.ASIS")))
    for one, two in (("R", "L"), ("L", "R")):
        apart = 1000 * np.linalg.norm(found[f"{one}.ASIS"] - found[f"{two}.PSIS"])
        assert f"{apart:.0f} mm from {one}.ASIS" in flags[0].message


@pytest.mark.parametrize("identifier", ["S05", "S08", "S09"])
def test_a_heel_marker_20_mm_aside_in_all_trials_is_seen(identifier):
    found = points(identifier)
    aside = found["R.Ankle"] - found["R.Ankle.Medial"]
    found["R.Heel"] = found["R.Heel"] + 0.02 * aside / np.linalg.norm(aside)
    assert "Heel across the foot" in {flag.where for flag in odd_sides(found)}


@pytest.mark.parametrize(
    ("identifier", "aside", "said"), [("S05", 0.03, True), ("S05", 0.012, False)]
)
def test_a_heel_marker_aside_of_a_foot_with_one_marker_in_front(identifier, aside, said):
    """As in Plug-in Gait, with a medial malleolus in standing."""
    found = points(identifier)
    for side in "RL":
        front = (found.pop(f"{side}.MT1") + found.pop(f"{side}.MT5")) / 2
        found.pop(f"{side}.MT2", None)
        found[f"{side}.Toe"] = front
    out = found["R.Ankle"] - found["R.Ankle.Medial"]
    found["R.Heel"] = found["R.Heel"] + aside * out / np.linalg.norm(out)
    assert ("Heel across the foot" in {flag.where for flag in odd_sides(found)}) == said


@pytest.mark.parametrize(
    ("marker", "up", "said"),
    [("Heel", 0.022, True), ("Ankle", -0.022, True), ("MT5", 0.018, True), ("MT2", -0.016, True),
     ("Heel", 0.004, False)],
)  # fmt: skip
def test_a_foots_marker_that_is_too_high_or_low_in_all_trials_is_seen(marker, up, said):
    """Both feet stand on one floor; a pose put together from the walk does not."""
    for identifier in ("S02", "S06"):
        found = points(identifier)
        found[f"R.{marker}"] = found[f"R.{marker}"] + [0.0, 0.0, up]
        where = f"{marker} above the floor"
        flags = {flag.where: str(flag) for flag in odd_sides(found)}
        assert (where in flags) == said
        if said:
            assert f"{1000 * found[f'R.{marker}'][2]:.0f} mm on the right" in flags[where]
        assert where not in {flag.where for flag in odd_sides(found, stood=False)}


def test_a_foot_on_its_toes_has_no_misplaced_marker():
    found = points("S02")
    for marker in ("Heel", "Ankle", "Ankle.Medial"):
        found[f"L.{marker}"] = found[f"L.{marker}"] + [0.0, 0.0, 0.03]
    assert not [flag for flag in odd_sides(found) if "above the floor" in flag.where]


@pytest.mark.parametrize("identifier", ["S02", "S06"])
def test_a_forefoots_markers_too_far_back_in_all_trials_are_seen(identifier):
    found = points(identifier)
    foot = (found["R.MT1"] + found["R.MT5"]) / 2 - found["R.Heel"]
    for marker in ("MT1", "MT5"):
        found[f"R.{marker}"] = found[f"R.{marker}"] - 0.022 * foot / np.linalg.norm(foot)
    assert [flag.where for flag in odd_sides(found)] == ["Heel to forefoot"]
