"""Who walks: a body, a policy, and reference motions at the speeds that can be predicted.

They are made in a run folder by the stages of `gaitval predict`, so a second start finds them
there.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

from gaitval.apps.patients.gentle_fit import gentle_reference
from gaitval.artefacts import file_hash
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import Subject
from gaitval.model.body import BodyModel
from gaitval.policy.processes import keeping_workers
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask
from gaitval.study.inputs import stored_policy
from gaitval.study.predicted_tasks import SPEEDS, range_stage, range_task
from gaitval.study.scaling_stages import scale_stage
from gaitval.study.stage import Observer, Run, Stage, open_run, run_stage
from gaitval.study.stored_policy import general_walker

GENERAL: Final = "general"
"""What the general policy is called in a log."""


@dataclass(frozen=True)
class LivePerson:
    """A person who can walk at several speeds.

    Attributes
    ----------
    subject : who it is.
    tasks : of one body, from the slowest reference to the fastest.
    policy : that walks them all.
    folder : run folder, with the references in it.
    references : hash of each task's reference, as its file has it.
    """

    subject: Subject
    tasks: tuple[WalkingTask, ...]
    policy: Policy
    folder: Path
    references: tuple[str, ...]

    @property
    def body(self) -> BodyModel:
        """The body as scaled."""
        return self.tasks[0].model

    @property
    def speeds(self) -> tuple[float, ...]:
        """Of the references, m/s, ascending."""
        return tuple(task.reference.speed for task in self.tasks)


def folder_of(subject: Subject) -> Path:
    """The run folder of a person who walks live, by default."""
    return Path("reports") / f"{subject.identifier}-live"


@contextmanager
def prepared(
    subject: Subject, folder: Path, observer: Observer, *, policy: Path | None = None
) -> Iterator[LivePerson]:
    """The person (`subject`, with at least one recorded trial) with references at all speeds; the
    run `folder` is this process' meanwhile, and what is up to date there is not computed again.
    `observer` sees the stages. `policy` is a folder with a policy of this person; None for the
    general one.

    Raises PolicyError if `policy` is not for this body, ConfigurationError if there is no general
    policy, SubjectError if no speed can be predicted for the person.
    """
    with open_run(subject, Configuration(), folder, observer) as run:
        stages = scale_stage(run), _range_stage(run)
        # the workers start only if references are to be found
        with keeping_workers(min(SPEEDS, os.cpu_count() or 1)):
            for stage in stages:
                run_stage(stage, folder, observer=observer)
        yield _person(run, stages[1].outputs, policy)


def _range_stage(run: Run) -> Stage:
    """`range_stage`; of who has a prosthesis with the fit that `gaitval patients` walks them with.
    The usual one ends far from some of their angles, and such a reference is fallen from.
    """
    side = run.subject.prosthesis
    if side not in SIDES:
        return range_stage(run)
    stage = range_stage(run, partial(gentle_reference, amputation=side))
    return replace(stage, values={**stage.values, "fit": "gentle"})


def _person(run: Run, references: tuple[str, ...], policy: Path | None) -> LivePerson:
    if policy is None:
        record, leg_length = run.known_record().record, run.subject.leg_length_m
        walker = general_walker(run.configuration.environment, record, leg_length)
    else:
        walker = stored_policy(run, policy)
    return LivePerson(
        subject=run.subject,
        tasks=tuple(range_task(run, name) for name in references),
        policy=walker,
        folder=run.folder,
        references=tuple(file_hash(run.folder / name) for name in references),
    )
