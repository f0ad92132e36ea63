"""Slippery ground, a wall and a step down, by what a rigid sled and a walker do on them."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fixtures import (
    PREDSIM,
    SLED_HEIGHT,
    SLED_RADIUS,
    random_policy,
    rigid_sled,
    task_of,
)

from gaitval.apps.balance.disturb import (
    DisturbedEnvironment,
    Planned,
    Slip,
    StepDown,
    Trip,
    checked,
)
from gaitval.constants import GRAVITY
from gaitval.errors import ConfigurationError
from gaitval.metrics.push_recovery import without_drift
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.contact.disturbed import Disturbed
from gaitval.walk.simulation.walker import Trajectory, Walker

SLED = rigid_sled(60.0)
WEIGHT = SLED.mass * GRAVITY
FRICTION = 0.8
ONE_MS = {"physics_step": 0.001, "steps_per_action": 50}
NO_OFFSET, NO_FORCE = np.zeros(25), np.zeros(6)


@pytest.fixture(scope="module")
def walker(task):
    q = np.zeros(31)
    q[5] = SLED_HEIGHT
    contact = PREDSIM.model_dump() | {"viscous_friction": 0.0, "dynamic_to_static": 1.0}
    made = Walker(task_of(SLED, task, q, contact=contact, environment=ONE_MS))
    mu = nominal_parameters()
    mu[PARAMETERS.index("friction")] = FRICTION
    made.set_parameters(mu)
    return made


def slide(walker, *, speed=0.0, height=0.0, steps=4, **ground):
    """Slide from a place at rest on level ground; gives the recording."""
    walker.body = walker.body._replace(law=Disturbed.around(walker.law)._replace(**ground))
    q, qd = np.zeros(31), np.zeros(31)
    q[5], qd[3] = SLED_HEIGHT + height, speed
    walker.reset(q, qd, 0.0)
    recording = Trajectory(50 * steps)
    for _ in range(steps):
        walker.step(NO_OFFSET, NO_FORCE, recording)
    return recording.steps()


def settled(walker, **ground):
    """Height at which it comes to rest."""
    return float(slide(walker, steps=20, **ground).positions[-1, 5])


@pytest.mark.parametrize(
    ("right", "left"), [(1.0, 1.0), (0.25, 0.25), (0.0, 1.0), (1.0, 0.1), (0.0, 0.0)]
)
def test_friction_falls_under_each_foot_by_its_own_grip_and_takes_what_energy_goes(
    walker, right, left
):
    rest = settled(walker) - SLED_HEIGHT
    steps = slide(walker, speed=3.0, height=rest, grip_right=right, grip_left=left)
    force, speed = steps.feet[:, :, :3].sum(axis=1), steps.velocities[:, 3]
    expected = FRICTION * (right * steps.feet[:, 0, 2] + left * steps.feet[:, 1, 2])
    assert -force[20:, 0] == pytest.approx(expected[20:], rel=0.02, abs=0.5)
    # momentum: the change of speed is the impulse
    impulse = 0.001 * force[1:, 0].sum()
    assert SLED.mass * (speed[-1] - speed[0]) == pytest.approx(impulse, rel=1e-3, abs=1e-6)
    # energy: what is lost is the work of friction, which never adds any
    power = force[1:, 0] * 0.5 * (speed[1:] + speed[:-1])
    assert (power <= 1e-9).all()
    lost = 0.5 * SLED.mass * (speed[0] ** 2 - speed[-1] ** 2)
    assert -0.001 * power.sum() == pytest.approx(lost, rel=1e-3, abs=1e-6)


def test_ground_that_is_lower_from_an_edge_on_carries_the_same_weight_lower(walker):
    level = settled(walker)
    steps = slide(walker, steps=40, edge=-1.0, drop=0.05)
    assert steps.positions[-1, 5] == pytest.approx(level - 0.05, abs=1e-4)
    assert steps.feet[-1, :, 2].sum() == pytest.approx(WEIGHT, rel=1e-3)
    # not before the edge
    assert settled(walker, edge=1.0, drop=0.05) == pytest.approx(level, abs=1e-9)


def test_a_wall_stops_the_foot_whose_path_it_crosses_and_gives_no_energy_back(walker):
    rest = settled(walker) - SLED_HEIGHT
    reach = 0.3 + SLED_RADIUS
    slippery = {"grip_right": 0.0, "grip_left": 0.0, "height": rest}
    free = slide(walker, speed=1.0, **slippery)
    assert free.velocities[-1, 3] == pytest.approx(1.0, rel=1e-6)
    # the six spheres of the left foot are the sled's front
    stopped = slide(
        walker, speed=1.0, steps=8, wall_side=1, wall=reach + 0.05, wall_height=0.3, **slippery
    )
    force, speed = stopped.feet[:, :, :3], stopped.velocities[:, 3]
    assert force[:, 0, 0] == pytest.approx(0.0, abs=1e-6)
    assert -1.0 <= speed[-1] < 0.0
    assert np.abs(speed).max() <= 1.0 + 1e-6
    # not further than where its three front spheres would have taken all its energy, elastically
    depth = np.linspace(0.0, 0.1, 2001)
    taken = 3.0 * np.cumsum(walker.law.static_force(SLED_RADIUS, depth)) * depth[1]
    deepest = depth[np.searchsorted(taken, 0.5 * SLED.mass)]
    assert 0.05 < stopped.positions[:, 3].max() < 0.05 + deepest
    impulse = 0.001 * force[1:, 1, 0].sum()
    assert SLED.mass * (speed[-1] - speed[0]) == pytest.approx(impulse, rel=1e-3)
    # nothing in the other foot's path, nor above the wall
    for other in ({"wall_side": 0}, {"wall_height": -0.1}):
        ground = {"wall_side": 1, "wall": reach + 0.05, "wall_height": 0.3} | other
        passed = slide(walker, speed=1.0, **ground, **slippery)
        assert passed.velocities[-1, 3] == pytest.approx(1.0, rel=1e-6)


@pytest.fixture(scope="module")
def walking(task):
    return DisturbedEnvironment(without_drift(task)), random_policy(task, scale=0.0)


def walked(walking, planned, **others):
    environment, policy = walking
    environment.planned = planned
    return record_rollout(
        environment, policy, mu=nominal_parameters(), start_phase=0.0, cycles=0.6, **others
    )


def test_level_ground_is_bit_for_bit_that_of_the_plain_law(walking):
    environment, policy = walking
    disturbed = walked(walking, None)
    plain = walked((WalkingEnvironment(environment.task), policy), None)
    assert np.array_equal(disturbed.positions, plain.positions)
    assert np.array_equal(disturbed.ground_reaction, plain.ground_reaction)


@pytest.mark.parametrize(
    "planned",
    [
        Planned(Slip("right", 0.05, 0.02), 0.06),
        Planned(Trip("left", 0.5, 0.06), 0.12),
        Planned(StepDown("left", 0.03), 0.06, edge=0.5),
    ],
)
def test_ground_changes_when_it_is_planned_and_not_before(walking, planned):
    plain, found = walked(walking, None), walked(walking, planned)
    environment, _ = walking
    rows = min(len(plain.time), len(found.time))
    away = np.abs(found.positions[:rows] - plain.positions[:rows]).any(axis=1)
    first = np.flatnonzero(away)
    if isinstance(planned.ground, StepDown):
        # it is there from the start, and noticed when the foot over the edge is loaded
        assert plain.time[first[0]] > 0.02
        assert environment.lift == pytest.approx(-0.03) or np.isnan(environment.began)
        return
    assert environment.began == pytest.approx(planned.start, abs=0.0061)
    assert plain.time[first[0]] >= environment.began
    if isinstance(planned.ground, Slip):
        assert environment.slid > 0.0
    else:
        assert environment.ended - environment.began == pytest.approx(0.06, abs=0.0061)
    assert environment.ground.grip_right in (0.05, 1.0)


@pytest.mark.parametrize(
    ("ground", "seen", "remedy"),
    [
        (Slip("right", 1.5), "1.5", "0 to 1"),
        (Trip("right", 0.0), "0", "0.05 to 0.95"),
        (StepDown("right", 3.0), "3", "m"),
        (replace(Slip(), side="both"), "both", "right or left"),
    ],
)
def test_ground_that_cannot_be_walked_on_is_refused(ground, seen, remedy):
    with pytest.raises(ConfigurationError) as refused:
        checked(ground)
    assert seen in str(refused.value)
    assert remedy in str(refused.value)
