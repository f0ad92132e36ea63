"""A side that no trial shows, curves that do not close, and markers that come into view late."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import made_up_session

from gaitval.configuration import Configuration, ProcessingSettings
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import RecordError
from gaitval.gait.cycle_checks import ODD_SUPPORT, without_odd_support
from gaitval.gait.cycles import GaitCycle
from gaitval.gait.mean_curves import fit_force
from gaitval.gait.record import MOMENT_NAMES, REQUIRED_ANGLES
from gaitval.inverse.inverse_kinematics import InverseKinematics
from gaitval.session.average import LARGEST_DRIFT, doubts_of_means
from gaitval.session.one_side import completed_sides
from gaitval.session.session import work_out
from gaitval.session.subject import subject_of
from gaitval.session.trial import smoothed
from gaitval.session.write import write_subject


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    session = made_up_session(tmp_path_factory.mktemp("lab"), noise=0.0)
    return work_out(session.request, Configuration().processing)


def only(found, side):
    """The same import, of trials that show whole cycles of one side only."""
    keep = f"_{side[0]}"
    other = next(one for one in SIDES if one != side)
    trials = tuple(replace(w, cycles=dict(w.cycles) | {other: ()}) for w in found.trials)
    return replace(
        found,
        trials=trials,
        angles={n: c for n, c in found.angles.items() if n.endswith(keep)},
        moments={n: c for n, c in found.moments.items() if n.endswith(keep)},
        forces={side: found.forces[side]},
    )


@pytest.mark.parametrize("side", SIDES)
def test_a_side_that_is_not_seen_is_the_other_ones_mirror_image(found, side, tmp_path):
    part = only(found, side)
    hidden = next(one for one in SIDES if one != side)
    subject = subject_of(part)
    assert subject.gait.mirrored == {"angles": hidden, "kinetics": hidden}
    for name in (*REQUIRED_ANGLES, *MOMENT_NAMES):
        own, twin = f"{name[:-2]}_{side[0]}", f"{name[:-2]}_{hidden[0]}"
        kind = subject.gait.angles if name in REQUIRED_ANGLES else subject.gait.moments
        assert kind[own] == kind[twin]
    shown, mirrored = (getattr(subject.gait.forces, one) for one in (side, hidden))
    assert mirrored.up == shown.up
    assert mirrored.forward == shown.forward
    np.testing.assert_allclose(mirrored.left.sine, -np.array(shown.left.sine), atol=1e-12)
    whole = subject_of(found)
    assert subject.left_phase == pytest.approx(whole.left_phase, abs=0.01)
    assert subject.walking_speed_m_s == pytest.approx(whole.walking_speed_m_s, rel=0.02)
    assert f"the {hidden} moments and forces were not recorded" in subject.described
    write_subject(tmp_path, subject)
    assert load_subject(str(tmp_path / "subject.toml")).gait.mirrored == subject.gait.mirrored
    (doubt,) = doubts_of_means(part.angles, part.forces)
    assert str(doubt).startswith(f"{hidden} leg: no trial shows a whole cycle of it")


def test_plates_that_show_one_foot_give_the_other_one_its_forces(found):
    part = replace(
        found,
        moments={n: c for n, c in found.moments.items() if n.endswith("_l")},
        forces={"left": found.forces["left"]},
    )
    both = completed_sides(part)
    assert both.mirrored == {"kinetics": "right"}
    np.testing.assert_array_equal(both.forces["right"], both.forces["left"] * [1, -1, 1])
    np.testing.assert_array_equal(both.angles["knee_angle_r"], found.angles["knee_angle_r"].mean)
    (doubt,) = doubts_of_means(part.angles, part.forces)
    assert "the subject's right moments and forces are those of the left side" in doubt.message


def drifting(found, name, degrees):
    """The import with a mean angle that ends elsewhere than it began."""
    curve = found.angles[name]
    drift = np.radians(degrees) * np.linspace(-0.5, 0.5, 101)
    return replace(found, angles=found.angles | {name: replace(curve, mean=curve.mean + drift)})


def test_a_curve_that_does_not_close_is_closed_and_told(found):
    assert doubts_of_means(found.angles, found.forces) == ()
    part = drifting(found, "knee_angle_l", 7.0)
    (doubt,) = doubts_of_means(part.angles, part.forces)
    assert doubt.where == "knee_angle_l"
    assert doubt.value == pytest.approx(7.0, abs=0.5)
    phase = np.linspace(0.0, 1.0, 101)
    before, after = (
        subject_of(one).gait.angles["knee_angle_l"].periodic()(phase) for one in (found, part)
    )
    np.testing.assert_allclose(after, before, atol=np.radians(0.3))


def test_an_angle_that_does_not_close_at_all_is_refused_or_left_out(found):
    most = np.degrees(LARGEST_DRIFT["angle"])
    with pytest.raises(RecordError, match=r"knee_angle_l ends 1\d\.\d° .*more than 10°"):
        subject_of(drifting(found, "knee_angle_l", most + 1.5))
    part = drifting(found, "foot_progression_l", most + 1.5)
    subject = subject_of(part)
    assert "foot_progression_l" not in subject.gait.angles
    assert "foot_progression_r" in subject.gait.angles
    (doubt,) = doubts_of_means(part.angles, part.forces)
    assert "left out of the subject" in doubt.message


def test_the_force_of_a_landing_beside_the_plates_is_that_of_the_landing_on_them():
    phase = np.linspace(0.0, 1.0, 101)
    force = np.zeros((101, 3))
    force[:60, 2] = 0.06 + np.sin(np.pi * phase[:60] / 0.6)
    fitted = fit_force(force, 0.6, "test")
    assert fitted.up.residual <= 0.01
    assert fitted.up.periodic()(0.0) == pytest.approx(0.06, abs=0.01)


def cycle(start, support, side="right"):
    return GaitCycle(
        side, start, start + 0.62, start + 1.0, start + support, start + 0.5, True, True
    )


def test_a_cycle_that_begins_with_a_wrong_heel_strike_does_not_count():
    good = tuple(cycle(start, 0.11 + 0.01 * start) for start in range(3))
    early = cycle(3.0, 0.11 + 0.01 + ODD_SUPPORT + 0.01)
    found = without_odd_support({"right": (*good, early), "left": ()})
    assert [one.kinematics_valid for one in found["right"]] == [True, True, True, False]
    assert not found["right"][-1].kinetics_valid
    assert "a wrong event" in str(found["right"][-1])
    few = {"right": (good[0],), "left": (early,)}
    assert without_odd_support(few) == few


def test_motion_before_its_markers_come_into_view_does_not_leak_into_it():
    """The pose held before the markers are seen must not be smeared into the seen ones."""
    frames, seen_from, rate = 200, 80, 100.0
    knee = COORDINATES.index("knee_angle_l")
    truth = 0.5 + 0.4 * np.sin(2 * np.pi * np.arange(frames) / 100)
    positions = np.zeros((frames, 31))
    positions[:, knee] = truth
    determined = np.ones((frames, 31), dtype=bool)
    determined[:seen_from, knee] = False
    late = positions.copy()
    late[:seen_from, knee] = 0.0
    nothing = np.zeros((frames, 1))
    poses = InverseKinematics(
        positions=late,
        determined=determined,
        **{
            field: nothing
            for field in InverseKinematics.__dataclass_fields__
            if field not in ("positions", "determined")
        },
    )
    found = smoothed(poses, rate, ProcessingSettings())
    np.testing.assert_allclose(found[seen_from:, knee], truth[seen_from:], atol=0.02)
    np.testing.assert_array_equal(found[:seen_from, knee], 0.0)
