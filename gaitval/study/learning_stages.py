"""The stages that learn to walk: what a policy starts from, whether it needs training, the
training, and which of both policies is handed on.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitval._internal.io.artefacts import copy_files, read_json, write_json
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import read_urdf
from gaitval.study.inputs import (
    GAIN,
    IDENTIFIED,
    NEED,
    POLICY_FILES,
    SIMULATION_SECTIONS,
    STANDING,
    identified_task,
    round_errors,
    start_kind,
    start_policy,
    stored_policy,
    walking_task,
)
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS

if TYPE_CHECKING:
    from gaitval.arrays import Array
    from gaitval.configuration import Start
    from gaitval.policy.storage import Policy
    from gaitval.walk.simulation.walker import WalkingTask

LEARNING_SECTIONS = (*SIMULATION_SECTIONS, "reward", "randomisation")


def _start_of(run: Run, round_number: int) -> str | None:
    """Folder of the policy that a round's training starts from; None for nothing."""
    if round_number > 1:
        return f"rounds/{round_number - 1}/policy"
    return "start" if (run.folder / "start").exists() else None


def _before_training(run: Run, round_number: int) -> list[str]:
    """Files of the start of a round's training, and of what is trained."""
    start, before = _start_of(run, round_number), f"rounds/{round_number - 1}"
    files = [] if start is None else [f"{start}/{name}" for name in POLICY_FILES]
    if round_number > 1:
        found = ("identification/identification.json", f"identification/{IDENTIFIED}")
        files += [f"{before}/{name}" for name in (*found, "epsilon.json")]
    return files


def _trained_task(run: Run, round_number: int) -> "WalkingTask":
    """Later rounds train for the identified body, if the record supports it."""
    before = f"rounds/{round_number - 1}"
    if round_number == 1 or not round_errors(run, round_number - 1).supported:
        return walking_task(run)
    found = read_json(run.folder / f"{before}/identification/identification.json")
    return identified_task(run, np.array(found["identified"]), f"{before}/identification")


def learned(
    run: Run, tasks: "Sequence[WalkingTask]", start: str | None, folder: Path, samples: int
) -> "Policy":
    """The policy of `run` for `tasks`: what is in its folder `start`, if that needs no training, or
    what is trained from it, or from nothing, over so many `samples` in `folder`.
    """
    subject, scaled = run.subject.identifier, read_urdf(run.folder / "model.urdf")
    policy = None if start is None else start_policy(run, run.folder / start)
    if policy is not None and not _trains(run, folder.parent):
        from gaitval.policy.storage import Policy, description, of_body
        from gaitval.policy.training_log import write_log

        write_log(folder / "training.csv", [])
        about = description(run.configuration, of_body(scaled, subject), 0)
        return Policy(policy.tensors, about)
    from gaitval.policy.training import train

    first, *rest = tasks
    return train(
        first, folder, also=rest, samples=samples, start=policy, subject=subject, scaled=scaled,
        on_progress=run.observer.progress,
    )  # fmt: skip


def _asked(run: Run) -> bool:
    """Whether training is asked for, needed or not."""
    return run.configuration.training.samples != "auto"


def _trains(run: Run, folder: Path) -> bool:
    """Whether a training of `run` is made, by what was found of its need in `folder`."""
    return _asked(run) or bool(read_json(folder / NEED)["needed"])


def need_files(run: Run, here: str) -> list[str]:
    """What a training of `run` reads about its need, in the sub-folder `here`: nothing if it is
    asked for, so that what measures the need does not matter to it.
    """
    return [] if _asked(run) else [f"{here}{NEED}"]


def need_stage(run: Run, round_number: int, speeds: Mapping[str, float] | None = None) -> Stage:
    """The policy that training in the round `round_number` of `run`, or of a range, starts from →
    how it walks, and whether it needs training. A range has `speeds`, as in `hand_on_stage`.
    """
    here, start = _place_of(round_number, speeds), _start_of(run, round_number)

    def compare() -> None:
        from gaitval.metrics.policy_comparison import standing_of
        from gaitval.metrics.tolerances import push_limit

        found = None
        if start is not None:
            tasks = _tasks_of(run, round_number, speeds)
            policy = start_policy(run, run.folder / start)
            found = standing_of(tasks, policy, _body_of(tasks[0]))
        needed = found is None or found.needs_training(push_limit())
        write_json(run.folder / here / STANDING, {"start": found and found.as_dict()})
        write_json(run.folder / here / NEED, {"needed": needed})
        if not (needed or _asked(run)):
            run.observer.say(
                "This person needs no training: the policy walks without a fall and stands the "
                "pushes (training.samples=full trains all the same)."
            )

    return Stage(
        "need-range" if speeds else f"need-{round_number}",
        compare,
        version=STAGE_VERSIONS["need"],
        inputs=("subject.toml", *_compared(run, round_number, speeds)),
        outputs=(f"{here}{STANDING}", f"{here}{NEED}"),
        values=_comparing(run, speeds),
    )


def _place_of(round_number: int, speeds: Mapping[str, float] | None) -> str:
    """Sub-folder of a run's folder for what a round, or a range of `speeds`, learns."""
    return "" if speeds else f"rounds/{round_number}/"


def _tasks_of(
    run: Run, round_number: int, speeds: Mapping[str, float] | None
) -> "list[WalkingTask]":
    """What is learned in a round of `run`, or in a range of `speeds` as in `hand_on_stage`."""
    if not speeds:
        return [_trained_task(run, round_number)]
    from gaitval.study.predicted_tasks import range_task

    return [range_task(run, name) for name in speeds]


def _compared(run: Run, round_number: int, speeds: Mapping[str, float] | None) -> list[str]:
    """Files that the policies of a round, or of a range, are compared on."""
    motions = speeds or ("reference.npz",)
    return ["model.urdf", *motions, *_before_training(run, round_number)]


def _comparing(run: Run, speeds: Mapping[str, float] | None) -> dict[str, Any]:
    """Values of a stage that compares policies of `run`, or of a range of `speeds`."""
    from gaitval.metrics.tolerances import push_limit

    validation, pushes = run.configuration.validation, run.configuration.pushes
    of_range = {**run.sections("record"), "speeds": list(speeds.values())} if speeds else {}
    return {
        **run.sections(*SIMULATION_SECTIONS, "randomisation"),
        "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        "pushes": pushes.model_dump(mode="json", include={"phases", "force", "cycles"}),
        "push_limit": push_limit(),
        **of_range,
    }


def _body_of(task: "WalkingTask") -> "Array":
    """mu (14,) with which the policy for `task` is tried."""
    found = task.reference_mu
    return nominal_parameters() if found is None else found


def train_stage(run: Run, round_number: int) -> Stage:
    """The training of `round_number` in `run`; round 1 starts from `start/` or nothing."""
    training = run.configuration.training
    here = f"rounds/{round_number}/trained"
    start = _start_of(run, round_number)
    further: Start = "policy" if _asked(run) else "needing"
    samples = training.samples_from(start_kind(run.folder) if round_number == 1 else further)

    def train() -> None:
        from gaitval.policy.storage import save_policy

        task = _trained_task(run, round_number)
        save_policy(learned(run, [task], start, run.folder / here, samples), run.folder / here)

    return Stage(
        f"train-{round_number}",
        train,
        version=STAGE_VERSIONS["train"],
        inputs=(
            *_compared(run, round_number, None),
            *need_files(run, _place_of(round_number, None)),
        ),
        outputs=tuple(f"{here}/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace=here,
    )


def hand_on_stage(run: Run, round_number: int, speeds: Mapping[str, float] | None = None) -> Stage:
    """Start and trained policy of the round `round_number` of `run`, or of a range → the better
    one, and what the training gained. A range has `speeds`, m/s, by the file of the reference.
    """
    here, start = _place_of(round_number, speeds), _start_of(run, round_number)
    log = ("training.csv",) if speeds else ()

    def decide() -> None:
        from gaitval.metrics.learning_gain import Standing
        from gaitval.metrics.policy_comparison import handed_on, learning_gain
        from gaitval.policy.storage import save_policy

        tasks = _tasks_of(run, round_number, speeds)
        trained_in, target = run.folder / f"{here}trained", run.folder / f"{here}policy"
        trained = stored_policy(run, trained_in)
        walked = read_json(run.folder / here / STANDING)["start"]
        before = None if walked is None else Standing.model_validate(walked)
        samples = int(trained.about["samples"])
        gain = learning_gain(tasks, before, trained, _body_of(tasks[0]), samples=samples)
        run.observer.say(gain.in_words())
        write_json(target / GAIN, gain.as_dict())
        started = None if start is None else start_policy(run, run.folder / start)
        save_policy(handed_on(gain, started, trained), target)
        copy_files(trained_in, target, log)

    return Stage(
        "keep-range" if speeds else f"keep-{round_number}",
        decide,
        version=STAGE_VERSIONS["keep"],
        inputs=(
            "subject.toml",
            *_compared(run, round_number, speeds),
            f"{here}{STANDING}",
            *(f"{here}trained/{name}" for name in (*POLICY_FILES, *log)),
        ),
        outputs=tuple(f"{here}policy/{name}" for name in (*POLICY_FILES, *log, GAIN)),
        values=_comparing(run, speeds),
    )
