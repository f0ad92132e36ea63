"""What stages read from a run folder."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaitval.artefacts import (
    read_json,
    replacing,
)

if TYPE_CHECKING:
    from gaitval.configuration import Start
    from gaitval.policy.storage import Policy
    from gaitval.simulation.walker import WalkingTask

from gaitval.study.stage import Run

POLICY_FILES = ("policy.safetensors", "policy.json")
"""A stored policy: its weights, and everything else about it."""


def start_kind(folder: Path) -> "Start":
    """What the first training of a run starts from."""
    about = folder / "start" / POLICY_FILES[1]
    if not about.exists():
        return "scratch"
    return "general" if read_json(about).get("general") else "policy"


def copy_files(source: Path, target: Path, names: tuple[str, ...]) -> None:
    """Copy files from one folder to another, each whole or not at all."""
    for name in names:
        copy_file(source / name, target / name)


def copy_file(source: Path, target: Path) -> None:
    """Copy a file, whole or not at all."""
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)


ROLLOUTS = {"nominal": "rollouts/nominal.npz", "identified": "rollouts/identified.npz"}
"""The compared rollout with each mu, as far as it is compared."""
IDENTIFIED = "identified.npz"
"""The reference motion of the identified body."""
WITNESS = "rollouts/witness.npz"
"""The compared rollout of the identified body in the second physics engine."""
GAIN = "gain.json"
"""Beside a policy: what its training gave (`metrics.learning_gain`)."""
UNFINISHED = {name: f"unfinished/{name}" for name in ("correct", "simulate", "push")}
"""Where an unfinished stage keeps the walks that it has done."""
REPEATS = "rollouts/repeats.json"
"""What is measured of repeats of the compared rollout."""
WALKS = "rollouts/walks.json"
"""How far the rollout from each start phase went."""


def stored_policy(run: Run, folder: Path) -> "Policy":
    """The policy in `folder`, refused if it is not for the body and settings of this run."""
    from gaitval.model.urdf import model_hash, read_urdf
    from gaitval.policy.storage import load_policy

    return load_policy(
        folder,
        model_hash=model_hash(read_urdf(run.folder / "model.urdf")),
        environment=run.configuration.environment,
    )


def start_policy(run: Run, folder: Path) -> "Policy":
    """The policy in `folder` to train from: a general one, or one for the body of this run."""
    from gaitval.model.urdf import model_hash, read_urdf
    from gaitval.policy.storage import load_start

    body = model_hash(read_urdf(run.folder / "model.urdf"))
    return load_start(
        folder,
        run.configuration.environment,
        model_hash=body,
        hidden_units=run.configuration.training.hidden_units,
    )


def walking_task(run: Run) -> "WalkingTask":
    """The walking task that training, identification and correction share."""
    from gaitval.model.urdf import read_urdf
    from gaitval.reference.motion import ReferenceMotion
    from gaitval.simulation.walker import WalkingTask

    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.told().record,
        reference=ReferenceMotion.load(run.folder / "reference.npz"),
        configuration=run.configuration,
    )


def range_task(run: Run, reference: str) -> "WalkingTask":
    """The walking task with another reference motion of the run folder."""
    from gaitval.model.urdf import read_urdf
    from gaitval.reference.motion import ReferenceMotion
    from gaitval.simulation.walker import WalkingTask

    found = ReferenceMotion.load(run.folder / reference)
    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.told(speed=found.speed).record,
        reference=found,
        configuration=run.configuration,
    )


def corrected_task(run: Run) -> "WalkingTask":
    """The task with the corrected reference, for the rollouts that are validated."""
    from gaitval.reference.adjustment import Adjustment, adjusted

    mu = body_parameters(run.folder / "identification.json") if _identified(run) else None
    task, path = identified_task(run, mu), run.folder / "correction.json"
    correction = Adjustment.from_dict(read_json(path), str(path))
    return replace(task, reference=adjusted(task.reference, task.reference_body, correction))


def _identified(run: Run) -> bool:
    """Whether a body was identified; a prediction walks with the body as scaled."""
    return (run.folder / IDENTIFIED).is_file()


def identified_task(run: Run, mu: NDArray[np.float64] | None, folder: str = ".") -> "WalkingTask":
    """The task with the reference that was made for the identified body.

    Parameters
    ----------
    mu : (14,) of that body; None for the body as scaled.
    folder : with its reference, inside the run's.
    """
    from gaitval.reference.motion import ReferenceMotion

    task = walking_task(run)
    if mu is None:
        return task
    reference = ReferenceMotion.load(run.folder / folder / IDENTIFIED)
    return replace(task, reference=reference, reference_mu=mu)


def body_parameters(identification: Path, which: str = "identified") -> NDArray[np.float64]:
    """Mu, (14,), from an identification's file; `which` is "nominal" or "identified"."""
    from gaitval.metrics.results import identification_from

    found = identification_from(read_json(identification), str(identification))
    return np.array(found.nominal if which == "nominal" else found.identified, dtype=float)
