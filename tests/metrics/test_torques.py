"""Toes, ringing, twist and creep of walks whose moments and motion are known."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, MODEL, STRIDE_TIME, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, RANGES, split_side
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.tolerances import evaluate
from gaitval.metrics.torques import (
    TORQUES,
    moment_ringing,
    torque_rate,
    torques_of,
)

HEIGHT = 1.53
WALK = perfect_walk(synthetic_record(), cycles=6)
CYCLES = find_cycles(WALK, sharp_filter())
SECONDS = slice(500, 2500)
"""Two seconds: waves of whole hertz do not leak."""


def _found(**arrays):
    """Values by measure and target."""
    found = torques_of(replace(WALK, **arrays), CYCLES, model=MODEL, height=HEIGHT)
    return {(each.measure, each.target): each.value for each in found.measures}


def _wave(name, hertz, size):
    moments = np.zeros_like(WALK.moments)
    moments[:, ACTUATED.index(name)] = size * MASS * np.sin(2 * np.pi * hertz * WALK.time)
    return replace(WALK, moments=moments)


@pytest.mark.parametrize(("hertz", "seen"), [(8.0, 0.0), (20.0, 1.0), (80.0, 1.0)])
def test_moments_ring_above_twelve_hertz_at_every_rate(hertz, seen):
    found = moment_ringing(_wave("knee_angle_l", hertz, 0.1), SECONDS, MASS)
    assert found.pop("knee_angle") == pytest.approx(0.1 / np.sqrt(2) * seen, abs=1e-9)
    assert list(found.values()) == pytest.approx([0.0] * 8, abs=1e-12)


JOINTS = ("hip", "knee", "ankle", "subtalar", "lumbar")
EVERY_AXIS = [name for name in ACTUATED if name.split("_")[0] in JOINTS]


@pytest.mark.parametrize("joint", EVERY_AXIS)
def test_every_axis_of_hip_knee_ankle_and_trunk_rings_under_its_own_name(joint):
    """0.1 Nm/kg at 20 Hz on one side: an RMS of 0.1 / sqrt(2), at most 2 pi 20 x 0.1 a second."""
    walk, name = _wave(joint, 20.0, 0.1), split_side(joint)[1]
    ringing, rate = (each(walk, SECONDS, MASS) for each in (moment_ringing, torque_rate))
    assert ringing.pop(name) == pytest.approx(0.0707107, rel=1e-4)
    assert rate.pop(name) == pytest.approx(12.566, rel=0.01)
    assert max(*ringing.values(), *rate.values()) == pytest.approx(0.0, abs=1e-12)


def test_toes_that_hold_against_their_extension_take_up_work():
    """0.2 Nm/kg against 1 rad/s through a stride; the other foot's toes do nothing."""
    moments, velocities = np.zeros_like(WALK.moments), np.zeros_like(WALK.velocities)
    moments[:, ACTUATED.index("mtp_angle_r")] = -0.2 * MASS
    velocities[:, COORDINATES.index("mtp_angle_r")] = 1.0
    found = _found(moments=moments, velocities=velocities)
    assert found["toe_moment_peak", "right"] == pytest.approx(0.2, rel=1e-3)
    assert found["toe_work", "right"] == pytest.approx(0.2 * STRIDE_TIME, rel=1e-2)
    assert found["toe_work", "left"] == found["toe_moment_peak", "left"] == 0.0


def test_the_free_moment_is_a_share_of_weight_and_height():
    free = np.zeros((len(WALK.time), 2))
    free[:, 1] = -0.005 * MASS * GRAVITY * HEIGHT
    found = _found(free_moment=free)
    assert found["free_moment_peak", "left"] == pytest.approx(0.5, rel=1e-3)
    assert found["free_moment_peak", "right"] == 0.0


def test_a_body_that_is_drawn_over_the_ground_creeps():
    """The whole body sunk in by 5 mm and moved at 7 cm/s, without turning."""
    positions = np.zeros_like(WALK.positions)
    lowest = min(s.position[2] - s.radius for s in MODEL.spheres if s.segment == "foot_r")
    joints = ("thigh_r", "shank_r", "foot_r")
    hip_to_sole = lowest + sum(MODEL[name].joint_position[2] for name in joints)
    positions[:, COORDINATES.index("pelvis_tz")] = -hip_to_sole - 0.005
    velocities = np.zeros_like(WALK.velocities)
    velocities[:, COORDINATES.index("pelvis_tx")] = 0.07
    found = _found(positions=positions, velocities=velocities)
    assert found["foot_creep", "right"] == pytest.approx(7.0, rel=1e-6)


def test_a_knee_beyond_the_models_own_range_is_said():
    positions = WALK.positions.copy()
    lowest = RANGES["knee_angle_l"][0]
    positions[:, COORDINATES.index("knee_angle_l")] = lowest - np.deg2rad(4.0)
    positions[:, COORDINATES.index("knee_angle_r")] = lowest
    found = _found(positions=positions)
    assert found["knee_beyond_range", "left"] == pytest.approx(4.0)
    assert found["knee_beyond_range", "right"] == 0.0


def test_every_measure_has_a_limit_that_is_context():
    found = torques_of(WALK, CYCLES, model=MODEL, height=HEIGHT).measures
    assert [(each.measure, each.target) for each in found] == list(TORQUES)
    rows = evaluate(found)
    assert {each.measure for each in rows} == {name for name, _ in TORQUES}
    assert {each.role for each in rows} == {"context"}


def test_a_walk_without_a_cycle_has_no_values():
    short = find_cycles(replace(WALK, ground_reaction=0.0 * WALK.ground_reaction), sharp_filter())
    found = torques_of(WALK, short, model=MODEL, height=HEIGHT)
    assert {each.value for each in found.measures} == {None}
    assert found.energy == {}
