"""The path of the centre of mass, and the balance of momentum, of walks where both are known."""

from dataclasses import replace

import numpy as np
import pytest
from momentum import momentum_residual
from newton_walk import MASS, STEP, newton_walk
from synthetic_walk import perfect_walk, periodic, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.whole_body import (
    centre_of_mass_measures,
    record_centre_of_mass,
    walked_centre_of_mass,
)
from gaitval.model.ground import Ground
from gaitval.subjects.prediction.slopes import weighted_sum
from gaitval.subjects.subject_file import builtin_subjects

RECORD = synthetic_record()
WALK = perfect_walk(RECORD, cycles=6)
CYCLES = find_cycles(WALK, sharp_filter())


def measured(walk=WALK):
    found = centre_of_mass_measures(
        walked_centre_of_mass(walk, CYCLES), record_centre_of_mass(RECORD)
    )
    return {(each.measure, each.target): each.value for each in found}


def test_a_force_that_swings_moves_the_centre_of_mass_by_newton_s_law():
    """a = g 0.1 cos ωt moves it by −g 0.1 / ω² cos ωt, ω = 2 · 2π / T."""
    half = {side: 1.0 for side in ("right", "left")}
    level = periodic(lambda phase: np.full(len(phase), 0.5), 3)
    up = periodic(lambda phase: 0.5 + 0.05 * np.cos(4 * np.pi * phase), 3)
    level = replace(level, mean=0.0)
    record = replace(
        RECORD,
        left_phase=0.5,
        stance_fraction=half,
        forces=dict.fromkeys(("right", "left"), (level, level, up)),
    )
    path = record_centre_of_mass(record)
    omega = 4 * np.pi / record.stride_time
    expected = -GRAVITY * 0.1 / omega**2 * np.cos(4 * np.pi * np.arange(101) / 100)
    np.testing.assert_allclose(path[:, 2], expected, atol=1e-6)
    np.testing.assert_allclose(path[:, :2], 0.0, atol=1e-12)


def test_a_force_to_the_left_accelerates_to_the_left():
    sway = periodic(lambda phase: 0.1 * np.cos(2 * np.pi * phase), 3)
    record = replace(
        RECORD,
        stance_fraction={"right": 1.0, "left": 0.0},
        forces=RECORD.forces | {"right": (RECORD.forces["right"][0], sway, periodic(np.ones_like))},
    )
    path = record_centre_of_mass(record)[:-1, 1]
    second = np.roll(path, -1) - 2 * path + np.roll(path, 1)
    assert np.corrcoef(second, np.cos(2 * np.pi * np.arange(100) / 100))[0, 1] > 0.999


def test_on_a_slope_the_path_is_the_same_in_the_room():
    """Forces in the axes of the ground give the path in those axes."""
    ground = Ground(8.0, 5.0)
    turned = {
        side: tuple(weighted_sum(curves, row) for row in ground.from_level.tolist())
        for side, curves in RECORD.forces.items()
    }
    found = record_centre_of_mass(replace(RECORD, forces=turned), ground)
    expected = record_centre_of_mass(RECORD) @ ground.from_level.T
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_people_rise_and_sway_by_centimetres():
    for subject in builtin_subjects():
        forward, left, up = np.ptp(record_centre_of_mass(subject.record()), axis=0)
        assert 0.005 < forward < 0.06
        assert 0.01 < left < 0.15
        assert 0.008 < up < 0.07


def test_a_walk_that_does_what_the_record_says_has_no_error():
    assert max(measured().values()) < 0.05


def test_steady_travel_and_drift_do_not_count():
    drift = replace(WALK, centre_of_mass=WALK.centre_of_mass + WALK.time[:, None] * [0.1, 0.02, 0])
    np.testing.assert_allclose(
        walked_centre_of_mass(drift, CYCLES), walked_centre_of_mass(WALK, CYCLES), atol=1e-9
    )


def test_a_centre_of_mass_that_sways_more_is_seen_along_its_axis():
    sway = 0.01 * np.sqrt(2.0) * np.sin(2 * np.pi * WALK.phase)
    found = measured(
        replace(WALK, centre_of_mass=WALK.centre_of_mass + sway[:, None] * [0.0, 1.0, 0.0])
    )
    assert found["centre_of_mass_rmse", "left"] == pytest.approx(10.0, rel=0.02)
    assert found["centre_of_mass_rmse", "up"] < 0.05


def test_without_a_cycle_nothing_is_measured():
    short = perfect_walk(RECORD, cycles=0.5)
    path = walked_centre_of_mass(short, find_cycles(short, sharp_filter()))
    assert path is None
    found = centre_of_mass_measures(path, record_centre_of_mass(RECORD))
    assert {each.value for each in found} == {None}


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_hidden_force_is_told_in_percent_of_the_weight(axis):
    hidden = np.zeros(3)
    hidden[axis] = 0.01 * MASS * GRAVITY
    assert momentum_residual(newton_walk(hidden), MASS) == pytest.approx(1.0, abs=0.05)
    assert momentum_residual(newton_walk(np.zeros(3)), MASS) < 0.05


def test_a_push_is_no_hidden_force():
    """Here a push that lasts: it is recorded as an external force."""
    pushed = newton_walk(np.array([0.0, 100.0, 0.0]))
    pushed.root_force[:, 4] = 100.0
    assert momentum_residual(pushed, MASS) < 0.05


@pytest.mark.parametrize("begin", [500, 625, 750, 875])
def test_a_hidden_force_of_a_window_s_length_is_seen_wherever_it_begins(begin):
    """1 % of the weight for 1 s: no window is off it by more than a quarter of its length."""
    hidden = np.zeros((2500, 3))
    hidden[begin : begin + 500, 0] = 0.01 * MASS * GRAVITY
    assert 0.7 < momentum_residual(newton_walk(hidden), MASS) < 1.05


def test_a_wrong_mass_is_seen():
    assert momentum_residual(newton_walk(np.zeros(3)), 1.02 * MASS) > 1.0


@pytest.mark.parametrize("seconds", [1.998, 1.9, 2 * STEP, STEP])
def test_a_short_walk_has_no_balance(seconds):
    assert momentum_residual(newton_walk(np.zeros(3), seconds=seconds), MASS) is None
    assert momentum_residual(newton_walk(np.zeros(3), seconds=2.004), MASS) < 0.05


def test_a_blow_within_one_step_is_no_hidden_force():
    """Its impulse of 42 Ns, 6 % of the weight over a window, is of the step that follows it, on
    whatever side of a window's edge that is."""
    for sample in (400, 500, 501, 502, 750, 751, 1001, 1002):
        struck = newton_walk(np.zeros(3))
        blow = 21_000.0  # N
        struck.ground_reaction[sample, 0, 0] += blow
        since = np.clip(np.arange(len(struck.time)) - sample, 0, None)
        struck.centre_of_mass[:, 0] += (blow * STEP / MASS * STEP * since).astype(np.float32)
        assert momentum_residual(struck, MASS) < 0.1


def test_on_a_slope_gravity_is_the_ground_s():
    """A walk whose ground pushes against turned gravity; on level ground it would need 5 % more."""
    ground = Ground(5.0, -3.0)
    level = newton_walk(np.zeros(3))
    turned = replace(
        level,
        ground_reaction=level.ground_reaction @ ground.from_level.T,
        centre_of_mass=(level.centre_of_mass @ ground.from_level.T).astype(np.float32),
    )
    assert momentum_residual(turned, MASS, ground) < 0.05
    assert momentum_residual(turned, MASS) == pytest.approx(
        100.0 * np.linalg.norm(ground.up - [0.0, 0.0, 1.0]), rel=0.02
    )
