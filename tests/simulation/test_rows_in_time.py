"""Everything in a row of a walk is of one instant: what acts, and what it does."""

from dataclasses import replace

import numpy as np
import pytest
from ground_again import engine_steps, ground_again
from simulation_fixtures import random_policy

from gaitval.coordinates import ACTUATED
from gaitval.metrics.torques import ground_rows, joint_work, mechanical_energy
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import Steps, WalkingTask


@pytest.fixture(scope="module")
def walk(task: WalkingTask) -> tuple[Rollout, Steps]:
    """A walk, and the steps of the engine that it was made of."""
    with engine_steps() as steps:
        found = falling(task, 0.2)
    return found, steps[0]


def falling(task: WalkingTask, phase: float) -> Rollout:
    """A walk of two fifths of a cycle, of a policy that has learnt nothing."""
    return record_rollout(
        WalkingEnvironment(task),
        random_policy(task, scale=0.2),
        mu=nominal_parameters(),
        start_phase=phase,
        cycles=0.4,
    )


def test_joint_work_row_by_row_is_the_engines(walk):
    """A step adds h τ·(v₋ + v₊)/2. The engine's own arrays multiplied row by row are 1 % off here,
    and 15-28 % of the net work in a long walk."""
    found, steps = walk
    step = found.time[1] - found.time[0]
    before, after = steps.velocities[:-1, 6:], steps.velocities[1:, 6:]
    engine = step * (steps.moments[1:] * 0.5 * (before + after)).sum()
    rows = step * (found.moments * found.velocities[:, 6:]).sum()
    late = step * (steps.moments * steps.velocities[:, 6:])[1:].sum()
    assert rows == pytest.approx(engine, rel=1e-12)
    assert abs(late / engine - 1.0) > 0.005


def test_velocities_are_central_differences_of_positions(walk):
    """Those of the joints, whose coordinates a step moves by their rates."""
    found, _ = walk
    step = found.time[1] - found.time[0]
    central = (found.positions[2:, 6:] - found.positions[:-2, 6:]) / (2.0 * step)
    np.testing.assert_allclose(found.velocities[1:-1, 6:], central, atol=1e-9)


def test_the_ground_acts_by_the_state_of_its_row(task, walk):
    """The contact law at the positions of a row and the engine's velocity there, beside the walk's
    wrench: force, centre of pressure and free moment, of both feet."""
    found, steps = walk
    feet, _ = ground_again(found, task, steps.velocities[:-1])
    ours = found.wrenches()
    # what the spheres carried before the walk is not in its record, and fades
    np.testing.assert_allclose(ours[40:, :, :3], feet[40:, :, :3], atol=0.5)  # N
    loaded = feet[40:, :, 2] > 50.0
    assert loaded.any(axis=0).all()
    np.testing.assert_allclose(ours[40:, :, 3:][loaded], feet[40:, :, 3:][loaded], atol=0.3)  # Nm
    assert np.abs(found.free_moment).max() > 0.5


def test_the_grounds_power_is_that_of_its_forces(task, walk):
    """Row by row that of the contact law's forces at the engine's states; of a foot in swing, too,
    which the law brakes from 2 cm above the ground: with less than a newton, but at the foot's
    speed. Whoever leaves that out misses ten times as much.
    """
    found, steps = walk
    rows, step = slice(40, None), found.time[1] - found.time[0]
    exact = (ground_again(found, task, steps.velocities[:-1])[1] * found.velocities).sum(axis=1)
    swings = np.isnan(found.centre_of_pressure[..., 0])
    nothing = np.where(swings[..., np.newaxis], 0.0, found.ground_reaction)

    def missed(walked: Rollout) -> tuple[float, float]:
        off = step * (ground_rows(walked, task.model).power.sum(axis=1) - exact)[rows]
        return float(np.abs(off).sum()), float(np.abs(off[swings.any(axis=1)[rows]]).sum())

    whole, swing = missed(found)
    assert whole < 0.03 * step * np.abs(exact[rows]).sum()
    assert missed(replace(found, ground_reaction=nothing))[1] > 10.0 * swing > 0.0


def test_joints_and_ground_explain_the_change_of_energy(task):
    """Of bodies that fall and step, from five phases: within a tenth of the ground's work, as a
    mean. Without that of the toes it misses by more.
    """
    missed, without_toes, grounds = [], [], []
    for phase in (0.0, 0.2, 0.4, 0.6, 0.8):
        found = falling(task, phase)
        rows = slice(20, len(found.time) - 1)
        model, step = task.model, found.time[1] - found.time[0]
        after, before = (mechanical_energy(found, model, row) for row in (rows.stop, rows.start))
        ground = ground_rows(found, model).power[rows].sum() * step
        toes = [6 + ACTUATED.index(f"mtp_angle_{side}") for side in "rl"]
        on_toes = (
            found.moments[rows][:, [each - 6 for each in toes]] * found.velocities[rows][:, toes]
        )
        missed.append(after - before - joint_work(found, rows).sum() - ground)
        without_toes.append(missed[-1] - on_toes.sum() * step)
        grounds.append(ground)
    assert np.abs(grounds).min() > 1.0
    assert np.abs(missed).sum() < 0.1 * np.abs(grounds).sum()
    assert np.abs(without_toes).sum() > 2.0 * np.abs(missed).sum()
