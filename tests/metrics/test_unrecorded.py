"""Arms and ringing of walks whose moments and forces are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_walk import MASS, STEP, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LUMBAR, SIDES
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.tolerances import evaluate
from gaitval.metrics.unrecorded import (
    force_ringing,
    step_width_measure,
    trunk_angles,
    unrecorded,
)
from gaitval.model.ground import Ground

RECORD = synthetic_record()
WALK = perfect_walk(RECORD, cycles=6)
CYCLES = find_cycles(WALK, sharp_filter())


def _found(**arrays):
    """Values by measure and target."""
    found = unrecorded(replace(WALK, **arrays), CYCLES, mass=MASS)
    return {(each.measure, each.target): each.value for each in found}


def test_the_moment_at_a_shoulder_is_that_of_its_three_axes():
    moments = np.zeros_like(WALK.moments)
    for name, size in (("arm_flex_l", 3.0), ("arm_add_l", -4.0), ("elbow_flex_l", 50.0)):
        moments[:, ACTUATED.index(name)] = size
    found = _found(moments=moments)
    assert found["shoulder_moment_rms", "left"] == pytest.approx(5.0)
    assert found["shoulder_moment_peak", "left"] == pytest.approx(5.0)
    assert found["shoulder_moment_rms", "right"] == 0.0


def test_the_peak_counts_in_whole_cycles_only():
    moments = np.zeros_like(WALK.moments)
    first, last = CYCLES.starts["right"][0], CYCLES.ends["right"][-1]
    moments[[first - 1, last], ACTUATED.index("arm_rot_r")] = 90.0
    moments[first, ACTUATED.index("arm_rot_r")] = 7.0
    found = _found(moments=moments)
    assert found["shoulder_moment_peak", "right"] == pytest.approx(7.0)


@pytest.mark.parametrize("side", SIDES)
def test_arms_that_work_a_tenth_as_much_as_the_legs(side):
    """Only work that is done counts, not what is taken up; the elbow is part of the arm."""
    moments, velocities = np.zeros_like(WALK.moments), np.zeros_like(WALK.velocities)
    moments[:, ACTUATED.index("knee_angle_r")] = 20.0
    velocities[:, COORDINATES.index("knee_angle_r")] = 1.0
    moments[:, ACTUATED.index(f"elbow_flex_{side[0]}")] = -1.0
    velocities[:, COORDINATES.index(f"elbow_flex_{side[0]}")] = -2.0
    moments[:, ACTUATED.index("mtp_angle_l")] = 5.0
    velocities[:, COORDINATES.index("mtp_angle_l")] = -1.0
    found = _found(moments=moments, velocities=velocities)
    assert found["arm_work_share", "walk"] == pytest.approx(10.0)


@pytest.mark.parametrize(("hertz", "seen"), [(10.0, 0.0), (18.0, 1.0), (30.0, 0.0)])
def test_ringing_is_what_is_in_the_band(hertz, seen):
    """A wave of amplitude a has an RMS of a/√2; over whole seconds, nothing leaks."""
    rows = slice(500, 2500)
    wave = 0.02 * MASS * GRAVITY * np.sin(2 * np.pi * hertz * WALK.time)
    ground = np.zeros_like(WALK.ground_reaction)
    ground[:, 0, 2] = 400.0 + 0.7 * wave
    ground[:, 1, 2] = 300.0 + 0.3 * wave
    found = force_ringing(replace(WALK, ground_reaction=ground), rows)
    assert found / (MASS * GRAVITY) == pytest.approx(0.02 / np.sqrt(2) * seen, abs=1e-9)
    assert pytest.approx(STEP) == WALK.time[1] - WALK.time[0]


def test_forces_that_cancel_do_not_ring():
    """The body feels both feet together."""
    wave = 50.0 * np.sin(2 * np.pi * 20.0 * WALK.time)
    ground = np.zeros_like(WALK.ground_reaction)
    ground[:, :, 2] = 300.0 + np.column_stack([wave, -wave])
    assert force_ringing(replace(WALK, ground_reaction=ground), slice(0, 3000)) < 1e-9


def test_without_a_cycle_nothing_is_said():
    short = perfect_walk(RECORD, cycles=0.3)
    found = unrecorded(short, find_cycles(short, sharp_filter()), mass=MASS)
    assert {each.value for each in found} == {None}


@pytest.mark.parametrize(
    ("axis", "name", "swing", "sd"),
    [
        (1, "tilt", 4.0 + 1.8, 1.0),
        (0, "lean", 3.3 + 2 * 1.4, 2.0),
        (2, "turn", 6.9 + 2.9, 1.0),
        (2, "turn", 6.0, 0.0),  # less than people's is no fault
    ],
)
def test_a_trunk_that_swings_is_told_in_deviations_between_people(axis, name, swing, sd):
    """Chung et al. 2010, table 2: mean and SD of the range over a cycle."""
    positions = np.zeros_like(WALK.positions)
    positions[:, axis] = np.deg2rad(0.5 * swing * np.cos(2 * np.pi * WALK.phase))
    found = _found(positions=positions)
    assert found.pop(("trunk_motion", name)) == pytest.approx(sd, abs=0.01)
    others = [value for (measure, _), value in found.items() if measure == "trunk_motion"]
    assert others == pytest.approx([0.0] * 3, abs=0.01)


def test_the_trunk_is_the_pelvis_and_what_the_lumbar_joint_adds():
    """One at a time, 10 degrees: the pelvis forward (about y), its left side down (about -x) and
    to the left (about z); the lumbar joint backward, to the right and to the left."""
    positions = np.zeros((7, 31))
    ten = np.deg2rad(10.0)
    positions[0, 1], positions[1, 0], positions[2, 2] = ten, -ten, ten
    for row, name in enumerate(LUMBAR, start=3):
        positions[row, COORDINATES.index(name)] = ten
    positions[6, 1] = positions[6, COORDINATES.index(LUMBAR[0])] = ten  # one undoes the other
    expected = np.zeros((7, 3))
    expected[:3] = np.diag([10.0, 10.0, 10.0])
    expected[3:6] = np.diag([-10.0, -10.0, 10.0])
    np.testing.assert_allclose(trunk_angles(positions), expected, atol=1e-9)


def test_the_trunk_s_angles_are_those_to_gravity_on_a_slope():
    """Normal to ground that rises ahead, or to the left, is a trunk that leans back, or right."""
    normal = np.zeros((1, 31))
    for ground, tilt, lean in (
        (Ground(10.0), -np.rad2deg(np.arctan(0.1)), 0.0),
        (Ground(0.0, 10.0), 0.0, -np.rad2deg(np.arctan(0.1))),
    ):
        found = trunk_angles(normal, ground)[0]
        np.testing.assert_allclose(found[:2], [tilt, lean], atol=1e-9)
        # in the axes of the ground an upright trunk leans the other way
        upright = normal.copy()
        upright[0, :3] = Rotation.from_matrix(ground.from_level).as_rotvec()
        np.testing.assert_allclose(trunk_angles(upright, ground)[0], 0.0, atol=1e-9)


@pytest.mark.parametrize("degrees", [7.2, -7.2])
def test_a_trunk_that_is_not_upright_is_told_whichever_way_it_tilts(degrees):
    positions = np.zeros_like(WALK.positions)
    positions[:, 1] = np.deg2rad(degrees)
    assert _found(positions=positions)["trunk_motion", "mean tilt"] == pytest.approx(2.0)


@pytest.mark.parametrize("power", [0.0, 1e-3])
def test_legs_that_do_no_work_have_no_share(power):
    """However little they do, the share is of that."""
    moments, velocities = np.zeros_like(WALK.moments), np.ones_like(WALK.velocities)
    moments[:, ACTUATED.index("knee_angle_r")] = power
    moments[:, ACTUATED.index("arm_flex_l")] = 0.5 * power
    share = _found(moments=moments, velocities=velocities)["arm_work_share", "walk"]
    assert share == (None if power == 0.0 else pytest.approx(50.0))


def test_the_lumbar_moment_is_that_of_its_three_axes():
    moments = np.zeros_like(WALK.moments)
    for name, size in zip(LUMBAR, (2.0, -3.0, 6.0), strict=True):
        moments[:, ACTUATED.index(name)] = size
    assert _found(moments=moments)["lumbar_moment_peak", "walk"] == pytest.approx(7.0 / MASS)


def test_a_step_width_is_told_in_deviations_between_people():
    """0.140 ± 0.031 leg lengths."""
    for width, sd in ((0.9 * 0.140, 0.0), (0.9 * 0.202, 2.0), (0.9 * 0.109, 1.0)):
        assert step_width_measure(width, 0.9).value == pytest.approx(sd, abs=1e-9)
    assert step_width_measure(None, 0.9).value is None


def test_a_recorded_step_width_is_what_the_walks_is_compared_with():
    """The limit is missed by a walk that is further from the person's own than it, either way."""
    for width, passed in ((0.15 + 0.039, True), (0.15 + 0.041, False), (0.15 - 0.041, False)):
        measure = step_width_measure(width, 0.9, 0.15)
        assert (measure.measure, measure.unit) == ("step_width_error", "cm")
        (verdict,) = evaluate([measure])
        assert (verdict.id, verdict.passed) == ("step-width-own", passed)
    assert step_width_measure(0.1509, 0.9, 0.1496).value == pytest.approx(0.13)
    assert step_width_measure(None, 0.9, 0.15).value is None
