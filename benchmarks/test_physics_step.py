"""Time of one physics step; run with `make bench`.

Every engine walks the same body (31 coordinates, 14 segments, 12 foot spheres on the ground) from
the same state of the reference for ten actions of 5 steps of 2 ms, one call per action, with the
joint servos following the reference; everything is timed:

* gaitval's compiled engine: Hunt-Crossley contact, servo, the account of every step;
* the same for eight walkers side by side, as in a training (`policy.walking_group`), where a
  compiled generator is handed their arrays once; the time is that of a walker's step;
* gaitval with DART as its engine, with the same contact and servo;
* MuJoCo's C step, `mj_step(..., nstep=5)`: springs and dampers are those of its joints, its Euler
  integrator is implicit in the dampers, contact is its default (Newton solver, pyramidal cones, to
  1e-8). tests/simulation/test_skeleton.py shows that it is the same body.

Below them DART alone, without ground: our compound joints, and the skeleton that `DartLoader`
builds from the URDF, a chain of one-axis joints and massless links for every compound joint.
Compare the ratios of one run, not times.
"""

import dartpy
import mujoco
import numpy as np
import pytest
from speed_ratio import speed_ratio

from gaitval._internal.numba.compiled import njit
from gaitval._internal.numba.lanes import WIDTH
from gaitval.configuration import Configuration
from gaitval.coordinates import ACTUATED
from gaitval.model.urdf import write_urdf
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.simulation.mujoco_body import MujocoBody
from gaitval.walk.simulation.side_by_side import SideBySide, advance_lanes
from gaitval.walk.simulation.skeleton import HumanSkeleton
from gaitval.walk.simulation.walker import Walker, WalkingTask

ACTIONS = 10
STEPS = ACTIONS * Configuration().environment.steps_per_action
GOAL = 10.0
"""Times MuJoCo's C step, per core, of the walkers side by side."""


@pytest.fixture(scope="module")
def task():
    subject = load_subject("S05")
    return WalkingTask.of(scale_subject(subject).model, subject.record(), Configuration())


def walking(task, engine):
    """The walk in one of our engines, ready to run repeatedly."""
    walker = Walker(task, engine=engine)
    start = task.reference.positions[0], task.reference.velocities[0]
    no_offset, no_force = np.zeros(25), np.zeros(6)

    def walk():
        walker.reset(*start, 0.0)
        for _ in range(ACTIONS):
            walker.step(no_offset, no_force)

    walk()  # compiles
    return walk


@njit
def actions(bodies, arrays, account, work):
    while True:
        advance_lanes(bodies, arrays, account, work)
        yield 0


def walking_side_by_side(task):
    """The walk in all eight lanes."""
    walkers = [Walker(task) for _ in range(WIDTH)]
    beside = SideBySide(walkers)
    arrays = beside.arrays
    walkers[0].reset(task.reference.positions[0], task.reference.velocities[0], 0.0)
    state, memory = (
        np.repeat(values[..., None], WIDTH, axis=-1)
        for values in (walkers[0].state, walkers[0]._memory)
    )
    arrays.pace[:] = 1.0
    actions_of_all = actions(beside.bodies, arrays, beside.account, beside.work)

    def walk():
        arrays.walkers.state[:], arrays.walkers.memory[:], arrays.phase[:] = state, memory, 0.0
        for _ in range(ACTIONS):
            next(actions_of_all)

    walk()  # compiles
    return walk


def walking_in_mujoco(task):
    """The same walk in MuJoCo; terms that do not depend on the state are set once per action."""
    walker, reference = Walker(task), task.reference
    stiffness, damping = walker.gains
    peer = MujocoBody(
        task.model, option=f'timestep="{walker.physics_step}" integrator="Euler"', floor=True
    )
    hinges = np.array([peer.model.joint(name).id for name in ACTUATED])
    peer.model.jnt_stiffness[hinges] = stiffness
    peer.model.dof_damping[peer.rates] = damping
    rows = np.arange(ACTIONS) * walker.action_seconds / reference.stride_time
    rows = np.round(rows * len(reference.phase)).astype(int)
    commands = (
        stiffness * reference.positions[rows, 6:]
        + damping * reference.velocities[rows, 6:]
        + reference.moments[rows]
    )
    peer.set(reference.positions[0], reference.velocities[0])
    start = peer.data.qpos.copy(), peer.data.qvel.copy()
    forces, rates = peer.data.qfrc_applied, peer.rates

    def walk():
        mujoco.mj_resetData(peer.model, peer.data)
        peer.data.qpos[:], peer.data.qvel[:] = start
        for command in commands:
            forces[rates] = command
            mujoco.mj_step(peer.model, peer.data, nstep=walker.steps_per_action)

    walk()
    assert peer.data.ncon > 0
    assert np.abs(peer.data.qpos[2] - reference.positions[rows[-1], 5]) < 0.1
    return walk


@pytest.mark.benchmark(group=f"{STEPS} physics steps of a walk")
def test_gaitval_compiled(benchmark, task):
    benchmark(walking(task, "compiled"))


@pytest.mark.benchmark(group=f"{STEPS} physics steps of a walk")
def test_gaitval_side_by_side(benchmark, task):
    benchmark.extra_info["walkers"] = WIDTH
    benchmark(walking_side_by_side(task))


@pytest.mark.benchmark(group=f"{STEPS} physics steps of a walk")
def test_gaitval_in_dart(benchmark, task):
    benchmark(walking(task, "dart"))


@pytest.mark.benchmark(group=f"{STEPS} physics steps of a walk")
def test_mujoco(benchmark, task):
    benchmark(walking_in_mujoco(task))


@pytest.mark.benchmark(group="the compiled engine and its peers, once")
def test_the_goal(benchmark, task):
    beside, ours = walking_side_by_side(task), walking(task, "compiled")
    in_mujoco, in_dart = walking_in_mujoco(task), walking(task, "dart")

    def ratio(theirs, walk, walkers=1):
        times = speed_ratio(lambda: theirs, walk, their_rounds=50, our_rounds=50)
        return walkers * times

    times_mujoco = benchmark.pedantic(lambda: ratio(in_mujoco, beside, WIDTH))
    benchmark.extra_info["times_mujoco"] = round(times_mujoco, 2)
    benchmark.extra_info["times_dart"] = round(ratio(in_dart, beside, WIDTH), 2)
    benchmark.extra_info["times_compiled"] = round(ratio(ours, beside, WIDTH), 2)
    assert times_mujoco >= GOAL


@pytest.mark.benchmark(group=f"{STEPS} physics steps of DART alone, no ground")
def test_compound_skeleton(benchmark, task):
    body = HumanSkeleton(task.model, physics_step=0.002)
    benchmark(lambda: [body.step() for _ in range(STEPS)])


@pytest.mark.benchmark(group=f"{STEPS} physics steps of DART alone, no ground")
def test_loader_skeleton(benchmark, task, tmp_path):
    write_urdf(task.model, tmp_path / "model.urdf")
    world = dartpy.simulation.World()
    world.setTimeStep(0.002)
    world.addSkeleton(dartpy.utils.DartLoader().parseSkeleton(str(tmp_path / "model.urdf")))
    benchmark(lambda: [world.step() for _ in range(STEPS)])
