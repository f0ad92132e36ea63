"""A change of a reference motion: its series, its slope, and what of the motion it moves."""

import numpy as np
import pytest

from gaitval.coordinates import COORDINATES
from gaitval.errors import ArtefactError
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.adjustment import JOINTS, Adjustment, adjusted
from gaitval.walk.reference.motion import build_reference


def series(order: int) -> Adjustment:
    random = np.random.default_rng(order)
    return Adjustment(random.normal(0.0, 0.01, (len(JOINTS), 1 + 2 * order)), 0.004)


def test_the_series_has_a_mean_then_cosines_then_sines():
    harmonics = np.zeros((len(JOINTS), 5))
    harmonics[0] = [0.3, 0.1, 0.02, -0.2, 0.05]
    phase = np.array([0.0, 0.1, 0.7])
    turn = 2.0 * np.pi * phase
    angles, slopes = Adjustment(harmonics, 0.0).angles(phase)
    expected = 0.3 + 0.1 * np.cos(turn) + 0.02 * np.cos(2 * turn)
    expected += -0.2 * np.sin(turn) + 0.05 * np.sin(2 * turn)
    np.testing.assert_allclose(angles[:, 0], expected, atol=1e-14)
    assert angles.shape == slopes.shape == (3, len(JOINTS))
    assert not angles[:, 1:].any()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_slope_is_that_of_the_angles_and_the_cycle_closes(order):
    change, phase, step = series(order), np.linspace(0.0, 1.0, 23), 1e-6
    _, slopes = change.angles(phase)
    numeric = (change.angles(phase + step)[0] - change.angles(phase - step)[0]) / (2 * step)
    np.testing.assert_allclose(slopes, numeric, atol=1e-8)
    np.testing.assert_allclose(change.angles(phase)[0][0], change.angles(phase)[0][-1], atol=1e-15)


def test_the_largest_change_is_of_any_joint_at_any_moment():
    harmonics = np.zeros((len(JOINTS), 3))
    harmonics[4] = [0.02, 0.03, -0.04]  # mean plus amplitude: 0.02 + 0.05
    harmonics[7] = [-0.06, 0.0, 0.0]
    assert Adjustment(harmonics, 0.0).largest() == pytest.approx(0.07, abs=1e-5)
    harmonics[7] = [-0.09, 0.0, 0.0]
    assert Adjustment(harmonics, 0.0).largest() == pytest.approx(0.09)


def test_what_is_written_is_read_and_anything_else_is_refused():
    change = series(2)
    values = change.as_dict()
    read = Adjustment.from_dict(values, "a.json")
    np.testing.assert_array_equal(read.harmonics, change.harmonics)
    assert read.height == change.height
    rows = values["harmonics"]
    for broken in (
        {"joints": list(JOINTS[::-1])},
        {"harmonics": rows[1:]},
        {"harmonics": [*rows, rows[0]]},
        {"harmonics": [row[1:] for row in rows]},
        {"harmonics": [[0.0, float("nan"), 0.0] for _ in rows]},
        {"harmonics": 0.0},
        {"harmonics": [0.0] * len(rows)},
        {"height": float("inf")},
        {"height": None},
    ):
        with pytest.raises(ArtefactError, match=r"a\.json: not a correction of the 13 angles"):
            Adjustment.from_dict({**values, **broken}, "a.json")
    with pytest.raises(ArtefactError):
        Adjustment.from_dict({"harmonics": rows, "height": 0.0}, "a.json")


@pytest.fixture(scope="module")
def reference():
    subject = load_subject("5")
    model = scale_subject(subject).model
    return build_reference(subject.record(), model), model


def test_a_reference_moves_by_the_change_and_in_nothing_else(reference):
    before, model = reference
    change = series(2)
    after = adjusted(before, model, change)
    angles, slopes = change.angles(before.phase)
    for i, name in enumerate(COORDINATES):
        moved = after.positions[:, i] - before.positions[:, i]
        faster = after.velocities[:, i] - before.velocities[:, i]
        if name in JOINTS:
            at = JOINTS.index(name)
            np.testing.assert_allclose(moved, angles[:, at], atol=1e-12)
            # by phase, of which a stride time has one
            np.testing.assert_allclose(faster, slopes[:, at] / before.stride_time, atol=1e-10)
        else:
            np.testing.assert_allclose(moved, 0.004 if name == "pelvis_tz" else 0.0, atol=1e-12)
            np.testing.assert_allclose(faster, 0.0, atol=1e-12)
    np.testing.assert_array_equal(after.moments, before.moments)
    np.testing.assert_array_equal(after.ground_reaction, before.ground_reaction)
    lifted = adjusted(before, model, Adjustment(0.0 * change.harmonics, 0.01))
    higher = lifted.centre_of_mass - before.centre_of_mass
    np.testing.assert_allclose(higher, np.tile([0.0, 0.0, 0.01], (len(higher), 1)), atol=1e-9)
