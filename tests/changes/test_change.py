"""Two sessions of one person: what is called changed, what not, and what is refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from smooth_curves import smooth_curves

from gaitval.apps.changes.change import change_between
from gaitval.apps.changes.results import ChangeResult
from gaitval.apps.changes.visits import Visit, VisitFigure
from gaitval.apps.changes.write import write_change
from gaitval.errors import ArtefactError, ConfigurationError

NAMES = tuple(
    f"{kind}/{joint}_{side}"
    for kind in ("angles", "moments")
    for joint in ("hip_flexion", "knee_angle", "ankle_angle")
    for side in "rl"
)
SIZE = {"angles": 1.0, "moments": 0.04}
BAND = {"angles": 4.0, "moments": 0.2}
AT_ONCE = 3.5


def visit(seed: int, **changes: object) -> Visit:
    """A session whose means are the same but for the spread of 8 cycles."""
    cycles, half = {}, {}
    phase = np.linspace(0.0, 2.0 * np.pi, 101)
    for number, name in enumerate(NAMES):
        kind = name.partition("/")[0]
        mean = 20.0 * SIZE[kind] * np.sin(phase + number)
        cycles[name] = mean + SIZE[kind] * smooth_curves(8, 20.0, 100 * seed + number)
        half[name] = np.full(101, BAND[kind])
    made = Visit(
        folder=Path(f"session-{seed}"),
        source="import",
        identifier=f"session-{seed}",
        person="",
        sex="F",
        mass_kg=62.0,
        height_m=1.68,
        leg_length_m=0.88,
        age_years=40.0,
        speed=1.2,
        curves={name: values.mean(axis=0) for name, values in cycles.items()},
        cycles=cycles,
        half=half,
        again=half,
        at_once=AT_ONCE,
        parameters={f"stance_fraction_{side}": VisitFigure(0.62, 0.01) for side in "rl"},
        static=f"{seed:064d}",
        processing={"marker_cutoff_hz": 8.0},
        marker_set="isb",
    )
    return replace(made, **changes)


def moved(session: Visit, name: str, by: np.ndarray | float) -> Visit:
    cycles = {**session.cycles, name: session.cycles[name] + by}
    return replace(
        session, cycles=cycles, curves={**session.curves, name: session.curves[name] + by}
    )


def bump(first: int, last: int, size: float) -> np.ndarray:
    values = np.zeros(101)
    values[first : last + 1] = size * np.sin(np.linspace(0.0, np.pi, last - first + 1)) ** 0.5
    return values


def test_a_large_change_is_said_in_words_with_its_band():
    found = change_between(visit(1), moved(visit(2), "angles/knee_angle_l", bump(64, 84, 16.0)))
    curve, region = found.findings()[0]
    assert (curve.name, region.level) == ("angles/knee_angle_l", "changed")
    assert region.difference == pytest.approx(16.0, abs=1.5)
    # two sessions, each with a band of 4
    assert region.half == pytest.approx(4.0 * math.sqrt(2.0))
    said = region.words
    assert said.startswith("Left knee flexion in swing +1")
    assert "± 5.7°" in said
    assert "% of the cycle" in said


@pytest.mark.parametrize(
    ("size", "level"), [(4.0, "re-measuring"), (8.0, "perhaps"), (15.0, "changed")]
)
def test_levels_are_those_of_the_two_bands(size, level):
    """90 % of one curve: 5.7; 95 % of all: 3.5 / 1.645 × 5.7 = 12."""
    found = change_between(visit(1), moved(visit(2), "angles/hip_flexion_r", size))
    levels = {c.name: r.level for c, r in found.findings() if c.name == "angles/hip_flexion_r"}
    assert levels == {"angles/hip_flexion_r": level}


def test_strides_that_hardly_differ_have_no_band():
    """Those of a simulated walk: the difference is what there is to say, and not ± 0.0."""
    before = visit(1)
    name = "angles/knee_angle_r"
    alike = {each: np.tile(curve, (8, 1)) + 1e-3 * np.arange(8)[:, None]
             for each, curve in before.curves.items()}  # fmt: skip
    before = replace(before, cycles=alike)
    found = change_between(before, moved(before, name, 3.0))
    assert found.same_markers
    curve, region = found.findings()[0]
    said = region.words
    assert curve.name == name
    assert "+3.0°" in said
    assert "±" not in said


def test_what_did_not_change_is_not_called_changed():
    found = change_between(visit(1), visit(2))
    assert not [r for _, r in found.findings() if r.level == "changed"]


def test_with_the_same_markers_the_cycles_decide():
    """3 degrees, half of what re-measuring may do."""
    before, after = visit(1), moved(visit(2), "angles/knee_angle_r", 3.0)
    assert not [
        r for _, r in change_between(before, after).findings() if r.level in ("changed", "perhaps")
    ]
    same = change_between(before, replace(after, static=before.static))
    assert same.same_markers
    assert {c.name for c, _ in same.findings()} == {"angles/knee_angle_r"}
    assert same.curves["angles/knee_angle_r"].half.mean() < 1.5


def test_few_cycles_are_said_and_the_bands_still_judge():
    few = {name: values[:2] for name, values in visit(2).cycles.items()}
    after = replace(moved(visit(2), "angles/knee_angle_r", 20.0), cycles=few)
    found = change_between(visit(1, cycles=few), after)
    assert found.test is None
    assert any("2 right" in note for note in found.notes)
    assert {c.name for c, r in found.findings() if r.level == "changed"} == {"angles/knee_angle_r"}


def test_without_bands_nothing_is_said_of_re_measuring():
    bare = {"half": {}, "again": {}, "at_once": None}
    found = change_between(visit(1, **bare), moved(visit(2, **bare), "angles/knee_angle_r", 5.0))
    assert {r.level for _, r in found.findings()} == {None}
    assert any("no bands" in note for note in found.notes)


def test_a_change_of_speed_is_said_first():
    found = change_between(visit(1), visit(2, speed=1.0))
    assert "1.20 m/s" in found.speed
    assert "1.00 m/s" in found.speed
    slower = change_between(visit(1), moved(visit(2, speed=1.0), "angles/knee_angle_r", 15.0))
    curve, region = slower.findings()[0]
    assert curve.name == "angles/knee_angle_r"
    assert region.by_speed is not None
    assert not change_between(visit(1), visit(2, speed=1.22)).speed


@pytest.mark.parametrize(
    ("changes", "seen", "remedy"),
    [
        ({"height_m": 1.76}, ("1.680", "1.760"), "--same-person"),
        ({"mass_kg": 80.0}, ("62.0", "80.0"), "--same-person"),
        ({"sex": "M"}, ("sex F and M",), "--sex"),
        ({"processing": {"marker_cutoff_hz": 6.0}}, ("marker_cutoff_hz: 8.0 and 6.0",), "--set"),
        ({"curves": {}}, ("no curve",), "same leg"),
    ],
)
def test_what_cannot_be_compared_is_refused(changes, seen, remedy):
    with pytest.raises(ConfigurationError) as refused:
        change_between(visit(1), visit(2, **changes))
    for each in (*seen, "session-1", "session-2", remedy):
        assert each in str(refused.value)


def test_moments_about_other_joint_centres_are_no_change_of_the_walk():
    from gaitval.apps.changes.visits import other_centres

    def centres(*given, hips=None):
        sources = {} if hips is None else {"sources": {"hips": hips}}
        rows = [
            {"side": "right", "joint": joint, "source": source, "used": used}
            for joint, source, used in given
        ]
        return other_centres({"functional": [], "given_centres": rows, "measurements": sources})

    model = centres(("knee", "first.osim", True))
    assert model == centres(("knee", "second.osim", True))
    assert model != centres(("knee", "Plug-in Gait", True))
    assert centres(("knee", "first.osim", False)) == {}
    assert centres(hips="markers, hip after Bell") != {}
    assert other_centres({"functional": [], "measurements": {}}) == {}
    usual = {"marker_cutoff_hz": 8.0}
    after = visit(2, processing=usual | model)
    with pytest.raises(ConfigurationError, match=r"right knee: by landmarks and of a scaled model"):
        change_between(visit(1), after)


def test_another_name_is_another_person_unless_one_says_so():
    before, after = visit(1, person="Ann"), visit(2, person="Bea")
    with pytest.raises(ConfigurationError, match="Ann and Bea"):
        change_between(before, after)
    assert change_between(before, after, same_person=True).curves


def test_a_side_that_one_session_lacks_is_said():
    right = {n: v for n, v in visit(2).curves.items() if n.endswith("_r")}
    found = change_between(visit(1), visit(2, curves=right))
    assert any("left side was recorded before only" in note for note in found.notes)
    assert all(name.endswith("_r") for name in found.curves)
    assert found.profiles is None


def test_what_is_written_is_what_was_found(tmp_path):
    found = change_between(visit(1), moved(visit(2), "angles/knee_angle_l", bump(64, 84, 16.0)))
    result = write_change(found, tmp_path)
    stored = json.loads((tmp_path / "change.json").read_text())
    assert ChangeResult.model_validate(stored) == result
    assert result.findings[0].startswith("Left knee flexion in swing")
    page = (tmp_path / "change.html").read_text()
    assert result.findings[0] in page
    assert (tmp_path / "change.pdf").read_bytes().startswith(b"%PDF")
    rows = (tmp_path / "change_curves.csv").read_text().splitlines()
    assert len(rows) == 1 + 101 * len(NAMES)
    assert "angles/knee_angle_l" in (tmp_path / "change.csv").read_text()


def test_a_folder_without_a_session_is_refused(tmp_path):
    from gaitval.apps.changes.visits import read_visit

    with pytest.raises(ArtefactError, match="neither") as refused:
        read_visit(tmp_path)
    assert str(tmp_path) in str(refused.value)
    assert "gaitval import" in str(refused.value)
