"""What an import of gaitval's own knows of the files that are judged: they lie in its folder."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.judge.request import JudgeRequest
from gaitval.importing.files import RECORD
from gaitval.importing.results import ImportResult, TrialResult

TRIAL: Final = "trial{}_"
"""What the names of a trial's files begin with."""


@dataclass(frozen=True)
class OfImport:
    """What an import says.

    Attributes
    ----------
    belt : m/s, of the treadmill; None over ground or without a motion of the import.
    solved_rms, solved_largest : m, marker errors of inverse kinematics, before its motion was
        filtered and written; None without a motion of the import.
    """

    belt: float | None = None
    solved_rms: float | None = None
    solved_largest: float | None = None


def with_import(request: JudgeRequest, name: str) -> tuple[JudgeRequest, OfImport | None]:
    """The `request` with what the import of its model, of this `name`, knows and nobody gave: mass
    and height of the person, and the speed of the belt; None where the model lies in no folder of
    an import.
    """
    path = request.model.parent / RECORD
    if not path.is_file():
        return request, None
    fix = "delete it, and give --mass, --height and --belt by hand"
    found = ImportResult.read(read_json(path), str(path), file=RECORD, fix=fix)
    person = found.person
    if person.identifier != name:  # a model of somebody else that was put there
        return request, None
    trial = _trial(found, request)
    known = replace(
        request,
        mass=_first(request.mass, lambda: person.mass_kg),
        height=_first(request.height, lambda: person.height_m),
        belt=_first(request.belt, lambda: None if trial is None else trial.belt_speed_m_s),
    )
    if trial is None:
        return known, OfImport()
    errors = trial.marker_errors_m["joint fit"]
    return known, OfImport(trial.belt_speed_m_s, errors.rms, errors.largest)


def _first(given: float | None, otherwise: Callable[[], float | None]) -> float | None:
    return otherwise() if given is None else given


def _trial(found: ImportResult, request: JudgeRequest) -> TrialResult | None:
    """The trial whose motion is judged, by the name of the file."""
    motion: Path | None = request.ik
    if motion is None or motion.parent.resolve() != request.model.parent.resolve():
        return None
    numbered = enumerate(found.trials, start=1)
    return next((t for n, t in numbered if motion.name.startswith(TRIAL.format(n))), None)
