"""Shipped: trains the general policy of reports/general, one walker for several bodies.

Training for anybody without a stored policy starts from it, which takes a few minutes instead of a
training from nothing. It learns on the people's angles only, each at three speeds, and on as many
virtual people: their gait at speeds between, on bodies of another size, whose parameters are drawn
from the prior of a body known by stature alone. Forces and moments are those expected from the
other people (record.use = "kinematics"), so it has never seen anybody's own. If interrupted,
it resumes.

    python -m experiments.general_policy --out first          # from nothing
    python -m experiments.general_policy --start first --samples 24000000    # the shipped one

What starts from another general policy learns more of the pushes that a slow or light person
hardly survives, and the policy kept is the mean of both: after the second training alone the slow
stand more pushes, but the walks of others are up to a third further from the record. Midway
between the two, both are as good as in the better one (Wortsman et al. 2022, "Robust fine-tuning
of zero-shot models"; figures in docs/what-we-tried.md).
"""

import argparse
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import value_hash, write_json
from gaitval.arrays import Array
from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import ConfigurationError
from gaitval.identification.prior import prior_sd
from gaitval.identification.virtual_person import drawn_parameters, of_another_size
from gaitval.policy.storage import Policy, load_start, save_policy
from gaitval.policy.training import TrainingProgress, policy_of, run_training
from gaitval.scaling.scaling import scale_subject
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.stored_policy import GENERAL
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import BUILTIN, builtin_subjects, load_subject
from gaitval.walk.simulation.walker import WalkingTask

TARGET: Final = Path(__file__).parent.parent / "reports" / GENERAL


SPEEDS: Final = (0.75, 1.0, 1.25)
"""Of the recorded one; at the others the angles are those expected of a change of speed."""
VIRTUAL: Final = len(SPEEDS)
"""Virtual people around each subject, at a speed between the slowest and the fastest."""
VIRTUAL_SEED: Final = 2026
"""Of the bodies and speeds of virtual people."""

PUSHES: Final = (
    "environment.push_probability=0.9",
    "environment.push_force=600",
    "environment.push_focus=400",
)
"""Settings of a training that starts from a general policy: fewer pushes that nobody survives."""

_Wanted = tuple[str, float, Configuration, tuple[str, ...]]
"""A subject's name, a share of the speed or the number of a virtual person, the configuration, and
the names of the people who are known."""


def walking(
    subject: Subject, share: float, wanted: _Wanted, mu: Array | None = None
) -> WalkingTask:
    """The walking task of a person, with the parameters mu (14,), at a share of their speed; what
    is not known is expected from the people named.
    """
    _, _, configuration, names = wanted
    others = [each for each in builtin_subjects() if each.identifier in names]
    speed = None if share == 1.0 else share * subject.walking_speed_m_s
    first = subject.model_copy(update={"trials": ()})
    known = known_record(first, configuration.record, others, speed=speed)
    model = scale_subject(subject).model
    return WalkingTask.of(model, known.record, configuration, known.accuracy, mu=mu)


def task_of(wanted: _Wanted) -> WalkingTask:
    """The walking task of a subject at a share of the recorded speed."""
    name, share, *_ = wanted
    return walking(load_subject(name), share, wanted)


def virtual_task_of(wanted: _Wanted, seed: int = VIRTUAL_SEED) -> WalkingTask:
    """The walking task of a virtual person, who is known by a subject's name, a number and the
    `seed` of all of them.
    """
    name, number, *_ = wanted
    random = np.random.default_rng([seed, list(BUILTIN).index(name), int(number)])
    person = of_another_size(load_subject(name), random)
    mu = drawn_parameters(prior_sd(person), random)
    return walking(person, random.uniform(min(SPEEDS), max(SPEEDS)), wanted, mu)


def built_in(
    names: Sequence[str],
    shares: Sequence[float],
    configuration: Configuration,
    known: Sequence[str],
) -> list[_Wanted]:
    """What `task_of` takes for each of these people at each share of their speed."""
    return [(name, share, configuration, tuple(known)) for name in names for share in shares]


def virtual(
    names: Sequence[str], configuration: Configuration, known: Sequence[str]
) -> list[_Wanted]:
    """What `virtual_task_of` takes for each virtual person around these people."""
    return built_in(names, range(VIRTUAL), configuration, known)


def about(subjects: list[str], policy: Policy, start: Policy | None) -> dict[str, Any]:
    """What the policy was trained with, and what that training started from."""
    return {
        "subjects": subjects,
        "told": "kinematics",
        "speeds": list(SPEEDS),
        "virtual": {"around each": VIRTUAL, "seed": VIRTUAL_SEED},
        "samples": policy.about["samples"],
        "start": start
        and {
            "samples": start.about["samples"],
            "kept": "the mean of start and training",
            "configuration": value_hash(start.about["configuration"]),
        },
    }


def midway(start: Policy, trained: Policy) -> Policy:
    """The mean of the tensors of a training's `start` and of what it `trained`, with the
    description of the latter. The two must be near each other, as a start and its training are.
    """
    tensors = {
        name: ((start.tensors[name].astype(np.float64) + each) / 2.0).astype(each.dtype)
        for name, each in trained.tensors.items()
    }
    return Policy(tensors, trained.about)


def train_general(
    tasks: Sequence[WalkingTask],
    folder: Path,
    *,
    samples: int,
    start: Policy | None = None,
    on_progress: TrainingProgress | None = None,
) -> Policy:
    """Train one policy on the bodies of several people, for trainings of each to start from.

    Observations are relative to the reference, so they mean the same for everybody. The
    environments are assigned to the tasks in turn. Otherwise as `train`.

    Parameters
    ----------
    tasks : one per person, all with the same configuration.
    folder, samples, start, on_progress : as `train` takes them.

    Raises
    ------
    ConfigurationError : the tasks' configurations differ, or there are fewer environments than
        tasks.
    PolicyError : `start` has other observations than these tasks.
    """
    configuration = tasks[0].configuration
    if any(task.configuration != configuration for task in tasks):
        raise ConfigurationError(
            "A general policy is trained with one configuration, but the tasks' configurations "
            "differ. Use the same one for all."
        )
    if configuration.training.environments < len(tasks):
        raise ConfigurationError(
            f"training.environments: {configuration.training.environments} environments are fewer "
            f"than the {len(tasks)} tasks of a general policy. Set it to a multiple of "
            f"{len(tasks)}."
        )
    learner = run_training(tasks, Path(folder), samples, start, on_progress)
    return policy_of(configuration, learner, {"general": True})


def printed() -> TrainingProgress:
    """Prints how far a training is that begins now, and how fast."""
    began = time.monotonic()

    def show(values: Mapping[str, float]) -> None:
        rate = values["samples"] / (time.monotonic() - began)
        print(
            f"{values['samples']:>10,.0f} of {values['total']:,.0f} samples, "
            f"{values['cycles']:.2f} cycles per episode, {rate:,.0f} samples/s",
            flush=True,
        )

    return show


def all_tasks(
    subjects: Sequence[str], configuration: Configuration, known: tuple[str, ...], workers: int = 2
) -> list[WalkingTask]:
    """Those of `subjects` at all speeds and of the virtual people around them."""
    wanted = built_in(subjects, SPEEDS, configuration, known)
    drawn = virtual(subjects, configuration, known)
    with ProcessPoolExecutor(workers) as pool:
        tasks = [*pool.map(task_of, wanted), *pool.map(virtual_task_of, drawn)]
    print(f"{len(tasks)} references", flush=True)
    return tasks


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", default=list(BUILTIN), help="default: all built in")
    parser.add_argument("--samples", type=int, default=22_000_000, help="default: %(default)s")
    parser.add_argument(
        "--alone", action="store_true", help="nothing is known of built-in people not named"
    )
    parser.add_argument(
        "--start", type=Path, help="start from this general policy, and keep the mean of both"
    )
    parser.add_argument("--work", type=Path, default=Path("reports/general-training"))
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    environments = (len(SPEEDS) + VIRTUAL) * len(arguments.subjects)
    configuration = load_configuration(
        settings=[
            f"training.environments={environments}",
            "record.use=kinematics",
            *(PUSHES if arguments.start else ()),
        ]
    )
    known = tuple(arguments.subjects if arguments.alone else BUILTIN)
    tasks = all_tasks(arguments.subjects, configuration, known)
    start = load_start(arguments.start, configuration.environment) if arguments.start else None
    policy = train_general(
        tasks, arguments.work, samples=arguments.samples, start=start, on_progress=printed()
    )
    save_policy(policy if start is None else midway(start, policy), arguments.out)
    write_json(arguments.out / "about.json", about(arguments.subjects, policy, start))
    print(f"{arguments.out}: {', '.join(POLICY_FILES)}. {arguments.work} may be deleted.")


if __name__ == "__main__":
    main()
