"""Time of one physics step; run with `make bench`.

The peer is DART itself: the skeleton as `DartLoader` builds it from the URDF, a chain of one-dof
joints and massless links for every compound joint. Compare the ratios of one run, not times.
"""

import dartpy
import numpy as np
import pytest

from gaitval.configuration import Configuration
from gaitval.data.subject import load_subject
from gaitval.scaling.scaling import scale_subject
from gaitval.scaling.urdf import write_urdf
from gaitval.simulation.skeleton import HumanSkeleton
from gaitval.simulation.walker import Walker, WalkingTask

STEPS = 1000


@pytest.fixture(scope="module")
def subject():
    return load_subject("S05")


@pytest.fixture(scope="module")
def model(subject):
    return scale_subject(subject).model


@pytest.mark.benchmark(group="1000 physics steps")
def test_loader_skeleton(benchmark, model, tmp_path):
    write_urdf(model, tmp_path / "model.urdf")
    world = dartpy.simulation.World()
    world.setTimeStep(0.002)
    world.addSkeleton(dartpy.utils.DartLoader().parseSkeleton(str(tmp_path / "model.urdf")))
    benchmark(lambda: [world.step() for _ in range(STEPS)])


@pytest.mark.benchmark(group="1000 physics steps")
def test_compound_skeleton(benchmark, model):
    body = HumanSkeleton(model, physics_step=0.002)
    benchmark(lambda: [body.step() for _ in range(STEPS)])


@pytest.mark.benchmark(group="1000 physics steps")
def test_walker_with_contact_and_servo(benchmark, subject, model):
    """The same steps with Hunt-Crossley contact, servo and the accounts of each step."""
    walker = Walker(WalkingTask.of(model, subject.record(), Configuration()))
    reference = walker.task.reference

    def walk():
        walker.reset(reference.positions[0], reference.velocities[0], 0.0)
        for _ in range(STEPS // walker.steps_per_action):
            walker.step(np.zeros(25), np.zeros(6))

    benchmark(walk)
