"""Shipped: trains the policy for slow strides, reports/general/slow.

The general policy learned on strides of at most 5 √(leg length/g), 1.5 s for an adult, and falls
where one takes half a second more. This one learns from it, on 120 virtual adults whose strides
take up to twice as long as others' at their speed do. Their episodes last twice as long, so that
as many strides fit, and their pushes are at most 300 N: of 600 N nobody so slow survives any,
and what falls at once learns nothing (docs/what-we-tried.md). If interrupted, it resumes.

    python -m experiments.slow_policy                   # trains, 25 min
    python -m experiments.slow_policy --try POLICY...   # walks 30 others with stored policies
"""

import argparse
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from claims.walking import falls
from experiments.general_policy import TARGET as GENERAL
from experiments.general_policy import printed, train_general
from gaitval._internal.io.artefacts import value_hash, write_json
from gaitval.configuration import Configuration, load_configuration
from gaitval.gait.dimensionless import speed_unit, time_unit
from gaitval.identification.prior import prior_sd
from gaitval.identification.virtual_person import drawn_parameters, of_another_size
from gaitval.policy.storage import Policy, load_start, save_policy
from gaitval.scaling.scaling import scale_subject
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.stored_policy import SLOW
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.subject_file import BUILTIN, builtin_subjects, load_subject
from gaitval.walk.simulation.walker import WalkingTask

TARGET: Final = GENERAL / SLOW
SAMPLES: Final = 20_000_000
AROUND_EACH: Final = 12
"""Virtual people of each of the ten: the person, and others of another size."""
SEED: Final = 779
TRIED: Final = (900, (1, 2, 3))
"""Seed and numbers of the people whom stored policies are tried on; nothing learns on them."""
SPEEDS: Final = (0.17, 0.32)
"""√(g · leg length), of the gait whose strides are made longer: 0.5 to 0.95 m/s for an adult."""
LONGER: Final = (1.0, 2.0)
SETTINGS: Final = (
    "record.use=kinematics",
    "environment.episode_seconds=18",
    "environment.push_probability=0.3",
    "environment.push_force=300",
    "environment.push_focus=200",
)
WALKED: Final = 50
"""Cycles of each start of the people whom policies are tried on."""

_Wanted = tuple[int, str, int, Configuration]
"""A seed, a subject's name, a virtual person's number, and the configuration."""


def task_of(wanted: _Wanted) -> tuple[WalkingTask, float]:
    """The walking task of a virtual person, and how long its stride is, √(leg length/g)."""
    seed, name, number, configuration = wanted
    random = np.random.default_rng([seed, list(BUILTIN).index(name), number])
    person = load_subject(name).model_copy(update={"trials": ()})
    if number:
        person = of_another_size(load_subject(name), random)
    mu = drawn_parameters(prior_sd(person), random)
    speed = random.uniform(*SPEEDS) * speed_unit(person.leg_length_m)
    known = known_record(person, configuration.record, builtin_subjects(), speed=speed, forced=True)
    longer = random.uniform(*LONGER)
    slow = replace(
        known.record,
        stride_time=known.record.stride_time * longer,
        speed=known.record.speed / longer,
    )
    model = scale_subject(person).model
    task = WalkingTask.of(model, slow, configuration, known.accuracy, mu=mu)
    return task, slow.stride_time / time_unit(person.leg_length_m)


def tasks(
    seed: int, numbers: Iterable[int], settings: Iterable[str]
) -> list[tuple[WalkingTask, float]]:
    """Those of the virtual people of a seed with these numbers, around each of the ten."""
    configuration = load_configuration(settings=list(settings))
    wanted = [(seed, name, number, configuration) for name in BUILTIN for number in numbers]
    with ProcessPoolExecutor(2) as pool:
        return list(pool.map(task_of, wanted))


def fell(policy: Policy, task: WalkingTask) -> int:
    """Of eight starts of a virtual person, with their own parameters: walks that end in a fall."""
    return falls(task, policy, task.reference_mu, WALKED)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--try", dest="tried", type=Path, nargs="+", metavar="POLICY")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="default: %(default)s")
    parser.add_argument("--work", type=Path, default=Path("reports/slow-training"))
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    if arguments.tried:
        people = sorted(tasks(*TRIED, SETTINGS), key=lambda each: each[1])
        for folder in arguments.tried:
            policy = load_start(folder, people[0][0].configuration.environment)
            found = [(round(stride, 2), fell(policy, task)) for task, stride in people]
            walk = sum(not falls for _, falls in found)
            print(f"{folder}: {walk} of {len(found)} walk; stride, falls of 8: {found}", flush=True)
        return
    environments = AROUND_EACH * len(BUILTIN)
    settings = (f"training.environments={environments}", "training.rollout_steps=64", *SETTINGS)
    learned = [task for task, _ in tasks(SEED, range(AROUND_EACH), settings)]
    print(f"{len(learned)} references", flush=True)
    start = load_start(GENERAL, learned[0].configuration.environment)
    policy = train_general(
        learned, arguments.work, samples=arguments.samples, start=start, on_progress=printed()
    )
    save_policy(policy, arguments.out)
    about = {
        "virtual": {"around each": AROUND_EACH, "seed": SEED},
        "speeds": SPEEDS,
        "strides longer by": LONGER,
        "samples": policy.about["samples"],
        "start": value_hash(start.about["configuration"]),
    }
    write_json(arguments.out / "about.json", about)
    print(f"{arguments.out}: {', '.join(POLICY_FILES)}. {arguments.work} may be deleted.")


if __name__ == "__main__":
    main()
