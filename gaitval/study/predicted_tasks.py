"""The references of a range of speeds, and what is walked there, from the files of run folders."""

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import ContactSettings
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import read_urdf
from gaitval.policy.processes import side_by_side
from gaitval.study.inputs import CENTRING, corrected_task, walking_task
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.prediction.known import KnownRecord
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.walker import WalkingTask

SPEEDS: Final = 6
"""Speeds that the policy of a range learns at."""

WIDEST: Final = 0.4
"""They reach this share below the slowest and above the fastest given trial."""


def range_speeds(known: Sequence[float]) -> list[float]:
    """The speeds that a policy learns at, m/s, from those of the given trials (`known`), m/s."""
    ends = (1.0 - WIDEST) * min(known), (1.0 + WIDEST) * max(known)
    # a geometric series: neighbouring speeds differ by the same percentage
    return [round(float(speed), 4) for speed in np.geomspace(*ends, SPEEDS)]


def range_stage(run: Run) -> Stage:
    """Given trials of `run` → reference motions at all speeds of the range."""
    speeds = speeds_of(run)

    def build() -> None:
        model = read_urdf(run.folder / "model.urdf")
        one = partial(_fitted_one, model, run.configuration.contact)
        known = (run.known_record(speed=speed) for speed in speeds.values())
        # each takes seconds and needs nothing of the others
        for done, (name, found) in enumerate(zip(speeds, side_by_side(one, known), strict=True)):
            found.save(run.folder / name)
            run.observer.progress({"samples": done + 1, "total": len(speeds)})

    return Stage(
        "range",
        build,
        version=STAGE_VERSIONS["range"],
        inputs=("subject.toml", "model.urdf"),
        outputs=tuple(speeds),
        values={**run.sections("contact", "record"), "speeds": list(speeds.values())},
    )


def _fitted_one(model: BodyModel, contact: ContactSettings, known: KnownRecord) -> ReferenceMotion:
    """The reference of one speed; a worker gets it pickled."""
    from gaitval.walk.reference.dynamic_fit import consistent_reference

    return consistent_reference(known.record, model, contact, known.accuracy)


def speeds_of(run: Run) -> dict[str, float]:
    """The speeds that the policy of `run` learns at, m/s, by the file of the reference."""
    from gaitval.subjects.prediction.speed import trials_known

    holdout = run.configuration.record.holdout or None
    speeds = range_speeds([t.walking_speed_m_s for t in trials_known(run.subject, holdout)])
    return {f"range/{index}.npz": speed for index, speed in enumerate(speeds)}


def range_task(run: Run, reference: str) -> WalkingTask:
    """The walking task of `run` with another `reference`, a file of its folder."""
    found = ReferenceMotion.load(run.folder / reference)
    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.expected_of(found, speed=found.speed),
        reference=found,
        configuration=run.configuration,
    )


def predicted_task(run: Run) -> tuple[WalkingTask, NDArray[np.float64]]:
    """As `inputs.validated_task`, for a prediction `run`: the body as scaled, and another share of
    the policy's action bias removed.
    """
    share = read_json(run.folder / CENTRING)["centring"]
    task = corrected_task(run, walking_task(run)).with_environment(centring=share)
    return task, nominal_parameters()
