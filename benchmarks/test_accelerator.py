"""The physics step on an accelerator over the compiled engine's on a core; run with `make bench`.

Walkers of one person go on from the same state for ten actions of 5 steps of 2 ms. Beside a GPU the
ratio says what it is worth; MuJoCo Warp on the processor is there to be tested, not to be fast, and
its ratio says so. Compare the ratios of one run, not times.
"""

import numpy as np
import pytest
import warp as wp
from speed_ratio import speed_ratio
from test_physics_step import ACTIONS, STEPS, walking_side_by_side

from gaitval.apps.accelerator.walkers import AcceleratedWalkers
from gaitval.configuration import Configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.lanes import WIDTH
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import Walker, WalkingTask

WALKERS = {True: (1024, 4096, 16384), False: (64,)}
"""How many at once, on a GPU and on the processor."""
CASES = [(device.alias, many) for device in wp.get_devices() for many in WALKERS[device.is_cuda]]


@pytest.fixture(scope="module")
def task():
    subject = load_subject("S05")
    return WalkingTask.of(scale_subject(subject).model, subject.record(), Configuration())


def accelerated(task, device, many):
    """The walk of as many, ready to begin. Their arrays may be one walker's: they are read only."""
    walker = Walker(task)
    walker.reset(task.reference.positions[0], task.reference.velocities[0], 0.0)
    together = AcceleratedWalkers([walker] * many, device)
    # On the device, as a policy there has them.
    inputs = [
        wp.array(values, dtype=float, device=device)
        for values in (np.zeros((many, 25)), np.zeros((many, 6)), np.ones(many))
    ]

    def walk():
        for _ in range(ACTIONS):
            together.advance(*inputs)
        together.synchronize()

    def started():
        together.enter()
        together.synchronize()
        return walk

    started()()  # compiles
    return started


@pytest.mark.benchmark(group=f"{STEPS} physics steps on an accelerator")
@pytest.mark.parametrize(("device", "many"), CASES)
def test_accelerator(benchmark, task, device, many):
    started, ours = accelerated(task, device, many), walking_side_by_side(task)

    def ratio():
        times = speed_ratio(started, ours, their_rounds=5, our_rounds=50)
        return (many / WIDTH) / times

    times_compiled = benchmark.pedantic(ratio)
    benchmark.extra_info["times_compiled"] = times_compiled
    print(f"\n{device}, {many:,} walkers: {times_compiled:.3g} times the compiled engine on a core")
    assert times_compiled > 0.0
