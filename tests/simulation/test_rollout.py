"""A recorded rollout: what it holds of a walk, and its file."""

from dataclasses import fields, replace

import numpy as np
import pytest
from simulation_fixtures import kinematics, random_policy

from gaitval.errors import ArtefactError
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.simulation.rollout import Rollout


@pytest.fixture(scope="module")
def rollout(task):
    return record_rollout(
        WalkingEnvironment(task, engine="dart"),
        random_policy(task, scale=0.1),
        mu=nominal_parameters(),
        start_phase=0.25,
        cycles=0.4,
    )


def test_a_rollout_holds_every_physics_step(task, rollout):
    steps = len(rollout.time)
    constants = task.configuration.environment
    each = constants.steps_per_action
    pace = np.diff(rollout.phase, prepend=0.25) * task.reference.stride_time
    # one a whole action; the last state of a walk, which no step follows, has no row
    pace = pace[: steps // each * each].reshape(-1, each) / constants.physics_step
    np.testing.assert_allclose(pace, np.tile(pace[:, :1], each), rtol=1e-9)
    assert 0.0 < np.abs(pace - 1.0).max() < 0.5
    last = 2.0 * rollout.phase[-1] - rollout.phase[-2]
    assert rollout.phase[-each] < 0.65 <= last  # as many as 0.4 cycles take
    np.testing.assert_allclose(np.diff(rollout.time), constants.physics_step, rtol=1e-9)
    assert rollout.time[0] == pytest.approx(constants.physics_step)
    assert not rollout.fell[0]
    shapes = {f.name: getattr(rollout, f.name).shape for f in fields(rollout)}
    assert shapes == {
        "time": (steps,),
        "phase": (steps,),
        "positions": (steps, 31),
        "velocities": (steps, 31),
        "moments": (steps, 25),
        "ground_reaction": (steps, 2, 3),
        "free_moment": (steps, 2),
        "centre_of_pressure": (steps, 2, 3),
        "centre_of_mass": (steps, 3),
        "root_force": (steps, 6),
        "mu": (14,),
        "start_phase": (1,),
        "fell": (1,),
        "hip_centre": (2, 2),
    }


def test_the_rollouts_centre_of_mass_is_darts(rollout, peer):
    for t in range(0, len(rollout.time), 50):
        peer.set(rollout.positions[t])
        np.testing.assert_allclose(rollout.centre_of_mass[t], peer.skeleton.getCOM(), atol=1e-12)


def test_the_centre_of_pressure_is_under_the_loaded_foot(task, rollout):
    """Under the loaded foot, between heel and toes; nowhere while the foot is in the air."""
    loaded = rollout.ground_reaction[:, :, 2] > 1.0
    np.testing.assert_array_equal(np.isfinite(rollout.centre_of_pressure[..., 0]), loaded)
    seen = 0
    for t in range(0, len(rollout.time), 20):
        frames = kinematics(task.model, rollout.positions[t], np.zeros(31))
        for i, side in enumerate("rl"):
            if rollout.ground_reaction[t, i, 2] > 100.0:
                ankle = frames.origin[SEGMENTS.index(f"foot_{side}")]
                arm = rollout.centre_of_pressure[t, i] - ankle
                assert -0.05 < arm[0] < 0.2
                assert abs(arm[1]) < 0.08
                assert rollout.centre_of_pressure[t, i, 2] == 0.0
                seen += 1
    assert seen > 10


def test_a_rollout_comes_back_from_its_file(rollout, tmp_path):
    rollout.save(tmp_path / "walk.npz")
    loaded = Rollout.load(tmp_path / "walk.npz")
    for field in fields(rollout):
        name = field.name
        seen, expected = getattr(loaded, name), getattr(rollout, name)
        exact = name in ("time", "phase")
        np.testing.assert_allclose(seen, expected, rtol=0.0 if exact else 1e-6, atol=1e-30)


def test_a_damaged_rollout_is_refused(rollout, tmp_path):
    path = tmp_path / "walk.npz"
    rollout.save(path)
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(ArtefactError, match="truncated"):
        Rollout.load(path)


@pytest.mark.parametrize("change", ["backwards", "a jump", "the first step", "twice"])
def test_a_rollout_whose_time_does_not_go_on_is_refused(rollout, tmp_path, change):
    """Its step is taken from the first two samples, so rates would be wrong."""
    time = rollout.time.copy()
    if change == "backwards":
        time = time[::-1].copy()
    elif change == "a jump":
        time[len(time) // 2 :] += 0.5
    elif change == "the first step":
        time[0] -= 0.01
    else:
        time[5] = time[4]
    path = tmp_path / "walk.npz"
    replace(rollout, time=time).save(path)
    with pytest.raises(ArtefactError, match=r"walk\.npz: time goes from .* Delete it"):
        Rollout.load(path)


def test_wrenches_are_what_force_plates_feel(rollout):
    """Of 10, -20 and 700 N, 0.1 m ahead and 0.05 m to the left, with a free moment of 3 Nm; a foot
    in the air has no place."""
    force, place = np.zeros((1, 2, 3)), np.full((1, 2, 3), np.nan)
    force[0, 1], place[0, 1] = [10.0, -20.0, 700.0], [0.1, 0.05, 0.0]
    found = replace(
        rollout, ground_reaction=force, centre_of_pressure=place, free_moment=np.array([[0.0, 3.0]])
    ).wrenches()
    np.testing.assert_allclose(found[0, 1], [10.0, -20.0, 700.0, 35.0, -70.0, 0.5])
    np.testing.assert_array_equal(found[0, 0], np.zeros(6))
