"""What stages read from a run folder."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.io.artefacts import copy_files, file_hash, read_json
from gaitval.metrics.identified_body import identified_model
from gaitval.model.urdf import model_hash, read_urdf
from gaitval.study.stage import Run

if TYPE_CHECKING:
    from gaitval.configuration import Start
    from gaitval.metrics.learning_gain import RoundErrors
    from gaitval.metrics.typed import Result
    from gaitval.model.body import BodyModel
    from gaitval.policy.storage import Policy
    from gaitval.subjects.prediction.known import KnownRecord
    from gaitval.walk.simulation.walker import WalkingTask

R = TypeVar("R", bound="Result")

SIMULATION_SECTIONS: tuple[str, ...] = ("seed", "contact", "servo", "environment")
"""Sections of the configuration that every stage that walks depends on."""
METRICS = "metrics.json"
POLICY_FILES = ("policy.safetensors", "policy.json")
"""A stored policy: its weights, and everything else about it."""


def start_kind(folder: Path) -> "Start":
    """What the first training of the run in `folder` starts from."""
    about = folder / "start" / POLICY_FILES[1]
    if not about.exists():
        return "scratch"
    return "general" if read_json(about).get("general") else "policy"


ROLLOUTS = {"nominal": "rollouts/nominal.npz", "identified": "rollouts/identified.npz"}
"""The compared rollout with each mu, as far as it is compared."""
IDENTIFIED = "identified.npz"
"""The reference motion of the identified body."""
WALKER = (
    "model.urdf",
    "reference.npz",
    IDENTIFIED,
    "identification.json",
    *(f"policy/{name}" for name in POLICY_FILES),
)
"""Files of the identified body and of the policy that walks it."""
PUSHED = "rollouts/pushed_ahead.npz", "rollouts/pushed_left.npz"
"""Walks with a push on the pelvis, for the replay."""
SECOND_ENGINE = "rollouts/second_engine.npz"
"""The compared rollout of the identified body in the second physics engine."""
GAIN = "gain.json"
"""Beside a policy: what its training gave (`metrics.learning_gain`)."""
STANDING = "standing.json"
"""How the policy walks that a training starts from (`metrics.learning_gain.Standing`; null if it
starts from nothing) ..."""
NEED = "need.json"
"""... and whether it needs training: by itself, so that other figures with the same answer do not
train again."""
CENTRING = "centring.json"
"""In the run of a prediction, which identifies nothing: the share of the policy's action bias that
is removed. Its body is the one that was scaled."""
STORED_FILES = (
    "subject.toml",
    "configuration.toml",
    *(f"policy/{name}" for name in (*POLICY_FILES, GAIN)),
    "identification.json",
    "correction.json",
    METRICS,
)
"""What a baseline keeps of a run folder; enough to simulate the policy again."""


def walked_files(folder: Path) -> tuple[str, ...]:
    """The files of a run, a baseline or a prediction in `folder` without which nobody walks."""
    predicted = (folder / CENTRING).is_file()
    return tuple(
        CENTRING if predicted and name == "identification.json" else name
        for name in STORED_FILES
        if name != METRICS
    )


REPEATS = "rollouts/repeats.json"
"""What is measured of repeats of the compared rollout."""
STARTS = "rollouts/starts.json"
"""How far the corrected walker got from every start phase, as the correction found ..."""
WALKS = "rollouts/walks.json"
"""... and with the compared rollouts in other engines."""


def stored(run: Run, name: str, kind: "type[R]") -> "R":
    """The result of a `kind` in the file `name` of the folder of `run`. Raises ArtefactError."""
    path = run.folder / name
    return kind.read(read_json(path), str(path), file=name, fix="run `gaitval subject` again")


def stored_policy(run: Run, folder: Path) -> "Policy":
    """The policy in `folder`; refused unless it is for the body and settings of `run`."""
    from gaitval.policy.storage import load_policy

    return load_policy(
        folder,
        model_hash=model_hash(read_urdf(run.folder / "model.urdf")),
        environment=run.configuration.environment,
    )


def start_policy(run: Run, folder: Path) -> "Policy":
    """The policy in `folder` to train from: a general one, or one for the body of `run`."""
    from gaitval.policy.storage import load_start

    body = model_hash(read_urdf(run.folder / "model.urdf"))
    return load_start(
        folder,
        run.configuration.environment,
        model_hash=body,
        hidden_units=run.configuration.training.hidden_units,
    )


def target_record(run: Run, model: "BodyModel | None" = None) -> "KnownRecord":
    """What the walk of `run` is to be: what it knew, and for kinetics that it did not know those of
    the estimate, of the scaled `model` or that of its folder.
    """
    from gaitval.subjects.prediction.slopes import is_changed

    # on a slope or with a load Newton's law says the kinetics, not an estimate of level ones
    if not run.knew_no_kinetics or is_changed(run.configuration.record):
        return run.known_record()
    # by its name: of a whole module the pages would be code of what computes
    from gaitval.study.estimate_stage import target_record as estimated

    return estimated(run, model)


def walking_task(run: Run) -> "WalkingTask":
    """The walking task of `run` that training, identification and correction share."""
    from gaitval.walk.reference.motion import ReferenceMotion
    from gaitval.walk.simulation.walker import WalkingTask

    reference = ReferenceMotion.load(run.folder / "reference.npz")
    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.expected_of(reference),
        reference=reference,
        configuration=run.configuration,
    )


def validated_task(run: Run) -> "tuple[WalkingTask, NDArray[np.float64]]":
    """The task of the validated rollouts of `run`, with the corrected reference, and mu (14,)."""
    mu = body_parameters(run.folder / "identification.json")
    return corrected_task(run, identified_task(run, mu)), mu


def corrected_task(run: Run, task: "WalkingTask") -> "WalkingTask":
    """The `task` with its reference as the correction of `run` changes it."""
    from gaitval.walk.reference.adjustment import Adjustment, adjusted

    path = run.folder / "correction.json"
    correction = Adjustment.from_dict(read_json(path), str(path))
    return replace(task, reference=adjusted(task.reference, task.reference_body, correction))


def identified_task(run: Run, mu: NDArray[np.float64], folder: str = ".") -> "WalkingTask":
    """The task of `run` with the reference in its sub-`folder` that was made for the identified
    body, whose parameters are `mu` (14,).
    """
    from gaitval.walk.reference.motion import ReferenceMotion

    reference = ReferenceMotion.load(run.folder / folder / IDENTIFIED)
    task = walking_task(run)
    model = identified_model(task.model, read_json(run.folder / folder / "identification.json"))
    return replace(task, model=model, reference=reference, reference_mu=mu)


def body_parameters(identification: Path, which: str = "identified") -> NDArray[np.float64]:
    """Mu (14,) in the file of an `identification`; `which` is "nominal" or "identified"."""
    from gaitval.metrics.results import identification_from

    found = identification_from(read_json(identification), str(identification))
    return np.array(found.nominal if which == "nominal" else found.identified, dtype=float)


def round_errors(run: Run, round_number: int) -> "RoundErrors":
    """Epsilon of the finished round `round_number` of `run`."""
    from gaitval.metrics.learning_gain import read_round

    return read_round(run.folder / f"rounds/{round_number}")


def start_from(run: Run, policy: Path) -> None:
    """Put the policy in the folder `policy` into `start/` of `run`; a training that has started
    from it continues. Raises PolicyError if there is none for this body and observation.
    """
    start_policy(run, policy)
    start = run.folder / "start"
    same = all(
        (start / name).is_file() and file_hash(start / name) == file_hash(policy / name)
        for name in POLICY_FILES
    )
    if not same:
        shutil.rmtree(start, ignore_errors=True)
        copy_files(policy, start, POLICY_FILES)
    run.observer.say(f"Training starts from the policy in {policy}.")
