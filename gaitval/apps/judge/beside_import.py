"""What an import of gaitval's own knows of the files that are judged: they lie in its folder."""

from dataclasses import replace
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.judge.request import JudgeRequest
from gaitval.session.importing.files import RECORD
from gaitval.session.importing.results import ImportResult, TrialResult

TRIAL: Final = "trial{}_"
"""What the names of a trial's files begin with."""


def with_import(request: JudgeRequest, name: str) -> JudgeRequest:
    """The `request` with what the import of its model, of this `name`, knows and nobody gave: mass
    and height of the person, and the speed of the belt; as it is where the model lies in no folder
    of an import.
    """
    path = request.model.parent / RECORD
    if not path.is_file():
        return request
    fix = "delete it, and give --mass, --height and --belt by hand"
    found = ImportResult.read(read_json(path), str(path), file=RECORD, fix=fix)
    person = found.person
    if person.identifier != name:  # a model of somebody else that was put there
        return request
    trial = _trial(found, request)
    return replace(
        request,
        mass=person.mass_kg if request.mass is None else request.mass,
        height=person.height_m if request.height is None else request.height,
        belt=trial.belt_speed_m_s if request.belt is None and trial else request.belt,
    )


def _trial(found: ImportResult, request: JudgeRequest) -> TrialResult | None:
    """The trial whose motion is judged, by the name of the file."""
    motion: Path | None = request.ik
    if motion is None or motion.parent.resolve() != request.model.parent.resolve():
        return None
    numbered = enumerate(found.trials, start=1)
    return next((t for n, t in numbered if motion.name.startswith(TRIAL.format(n))), None)
