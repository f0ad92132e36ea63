"""Subject 5 at three speeds, without further fits: its reference, and the same made slower and
quicker."""

from dataclasses import replace

import pytest

from gaitval.apps.live.person import LivePerson
from gaitval.apps.live.walk import LiveWalk
from gaitval.datasets.subject_file import load_subject
from gaitval.study.stored_policy import general_walker

QUICKER = 1.1


def at_another_speed(task, factor):
    """The same steps, made `factor` times as fast."""
    reference = replace(
        task.reference,
        speed=factor * task.reference.speed,
        stride_time=task.reference.stride_time / factor,
        velocities=factor * task.reference.velocities,
    )
    return replace(task, reference=reference)


@pytest.fixture(scope="session")
def person(task, tmp_path_factory):
    factors = (1.0 / QUICKER, 1.0, QUICKER)
    return LivePerson(
        subject=load_subject(5),
        tasks=tuple(at_another_speed(task, factor) for factor in factors),
        policy=general_walker(task.configuration.environment),
        folder=tmp_path_factory.mktemp("live"),
        references=tuple(f"reference {factor:.2f}" for factor in factors),
    )


@pytest.fixture
def walk(person):
    return LiveWalk(person, person.speeds[1])
