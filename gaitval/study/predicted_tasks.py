"""What a range of speeds and its predictions walk, from the files of their run folders."""

import numpy as np
from numpy.typing import NDArray

from gaitval.artefacts import read_json
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import read_urdf
from gaitval.reference.motion import ReferenceMotion
from gaitval.simulation.walker import WalkingTask
from gaitval.study.inputs import corrected_task, walking_task
from gaitval.study.stage import Run


def range_task(run: Run, reference: str) -> WalkingTask:
    """The walking task of `run` with another `reference`, a file of its folder."""
    found = ReferenceMotion.load(run.folder / reference)
    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.told(speed=found.speed).record,
        reference=found,
        configuration=run.configuration,
    )


def predicted_task(run: Run) -> tuple[WalkingTask, NDArray[np.float64]]:
    """As `inputs.validated_task`, for a prediction `run`: the body as scaled, and another share of
    the policy's action bias removed.
    """
    share = read_json(run.folder / "centring.json")["centring"]
    task = corrected_task(run, walking_task(run)).with_environment(centring=share)
    return task, nominal_parameters()
