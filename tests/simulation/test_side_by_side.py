"""Eight walkers side by side walk as each of them alone."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fixtures import changed, kinematics, random_state

from gaitval._internal.numba.lanes import WIDTH
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.model.tree import tree_arrays
from gaitval.walk.simulation.side_by_side import SideBySide
from gaitval.walk.simulation.walker import Walker


def parameters(lane):
    """Another body, damping and friction in each lane."""
    mu = nominal_parameters()
    mu[0] *= 1.0 + 0.1 * lane
    mu[1] = 0.4 + 0.08 * lane
    mu[2:5] += 0.01 * (lane - 3)
    mu[5:] = 0.002 * (lane - 4)
    return mu


def lowest(model, positions):
    """Height of the lowest point of the spheres, m."""
    frames, tree = kinematics(model, positions, np.zeros(31)), tree_arrays(model)
    rotation, origin = (each[tree.sphere_segment] for each in (frames.rotation, frames.origin))
    centres = np.einsum("kij,kj->ki", rotation, tree.sphere_position) + origin
    return float((centres[:, 2] - tree.sphere_radius).min())


def walkers_of(tasks, states):
    walkers = []
    for lane, (positions, velocities) in enumerate(states):
        walker = Walker(tasks[lane % len(tasks)])
        walker.set_parameters(parameters(lane))
        walker.reset(positions, velocities, lane / WIDTH + 0.01)
        walkers.append(walker)
    return walkers


def placed(walkers):
    """The walkers' states in lanes."""
    beside = SideBySide(walkers)
    arrays = beside.arrays
    for lane, walker in enumerate(walkers):
        arrays.walkers.state[..., lane] = walker.state
        arrays.walkers.memory[..., lane] = walker._memory
        arrays.walkers.offset[..., lane] = walker.offset
        arrays.phase[0, lane] = walker.phase
    return beside


def both_walk(walkers, actions, seed):
    """All walk, alone and side by side; yields after every action."""
    beside, random = placed(walkers), np.random.default_rng(seed)
    arrays = beside.arrays
    for _ in range(actions):
        offsets = random.normal(0.0, 0.03, (25, WIDTH))
        pushes = random.normal(0.0, 40.0, (6, WIDTH))
        arrays.next_offset[:], arrays.root_force[:] = offsets, pushes
        arrays.pace[:] = random.uniform(0.8, 1.2, WIDTH)
        beside.advance()
        for lane, walker in enumerate(walkers):
            offset, push = offsets[:, lane].copy(), pushes[:, lane].copy()
            walker.step(offset, push, pace=arrays.pace[0, lane])
        arrays.walkers.offset[:] = offsets
        yield arrays


def assert_equal(arrays, walkers):
    for lane, walker in enumerate(walkers):
        seen = arrays.walkers
        np.testing.assert_array_equal(seen.state[..., lane], walker.state)
        np.testing.assert_array_equal(seen.memory[..., lane], walker._memory)
        np.testing.assert_array_equal(seen.ground[..., lane], walker.mean_ground_reaction)
        np.testing.assert_array_equal(seen.moments[..., lane], walker.mean_moments)
        np.testing.assert_array_equal(seen.squares[..., lane], walker.mean_square_moments)
        assert arrays.phase[0, lane] == walker.phase


@pytest.fixture(scope="module")
def tasks(task):
    """Two tasks that differ in reference and contact."""
    shifted = replace(task.reference, positions=task.reference.positions + 0.01)
    return [task, replace(changed(task, contact={"stiffness": 1e6}), reference=shifted)]


def test_a_walk_is_bit_for_bit_the_same_in_any_lane(tasks):
    """200 steps from eight phases of the cycle: heel strikes and toe-offs of both feet, so that
    in most steps a foot is loaded in some lanes and in the air in others."""
    rows = [round((lane / WIDTH + 0.01) * 1024) for lane in range(WIDTH)]
    states = [(tasks[0].reference.positions[r], tasks[0].reference.velocities[r]) for r in rows]
    walkers = walkers_of(tasks, states)
    loaded = []
    for arrays in both_walk(walkers, 40, seed=0):
        assert_equal(arrays, walkers)
        loaded.append(arrays.walkers.ground[:, 2] > 50.0)
    for foot in (0, 1):
        share = np.array(loaded)[:, foot].mean(axis=1)
        assert ((share > 0.0) & (share < 1.0)).mean() > 0.5


@pytest.mark.parametrize("seed", range(5))
def test_random_states_in_the_air_and_on_the_ground(tasks, seed):
    """Every other lane starts with its lowest sphere 10 mm deep, the others up in the air."""
    states = []
    for lane in range(WIDTH):
        positions, velocities = random_state(10 * seed + lane)
        body = apply_parameters(tasks[0].model, parameters(lane))
        positions[5] -= lowest(body, positions) + 0.01
        positions[5] += 1.0 if lane % 2 == 0 else 0.0
        states.append((positions, velocities))
    walkers = walkers_of(tasks, states)
    touching = np.zeros(WIDTH, dtype=bool)
    for arrays in both_walk(walkers, 3, seed):
        assert_equal(arrays, walkers)
        touching |= arrays.walkers.ground[:, 2].any(axis=0)
    assert touching[1::2].all()
    assert not touching[::2].any()


def test_a_walker_that_diverges_does_not_touch_its_neighbours(tasks):
    rows = [100 * lane for lane in range(WIDTH)]
    states = [(tasks[0].reference.positions[r], tasks[0].reference.velocities[r]) for r in rows]
    walkers = walkers_of(tasks, states)
    beside = placed(walkers)
    beside.arrays.walkers.state[:, :, 3] = np.nan
    beside.arrays.pace[:] = 1.0
    beside.advance()
    for lane, walker in enumerate(walkers):
        walker.step(np.zeros(25), np.zeros(6))
        if lane != 3:
            np.testing.assert_array_equal(beside.arrays.walkers.state[..., lane], walker.state)
    assert np.isnan(beside.arrays.walkers.state[..., 3]).any()
