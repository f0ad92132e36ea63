"""An import from the words of a user to the files of a folder, for the command and for Python."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, Unpack

from gaitval.configuration import Configuration
from gaitval.datasets.subject import Subject
from gaitval.errors import GaitvalError, RecordError
from gaitval.folder_lock import held
from gaitval.scaling.landmarks import Width
from gaitval.session.halves import Halves, halves_of
from gaitval.session.person import person_of_session
from gaitval.session.refusal import write_refusal
from gaitval.session.request import HipCentre, Request, Tell, silent
from gaitval.session.session import Import, Progress, work_out
from gaitval.session.subject import subject_of
from gaitval.session.write import check_folder, write_import, write_subject


class Options(TypedDict, total=False):
    """What an import may be told beside the trials and the person.

    Attributes
    ----------
    forces : ground reaction of each trial, where it is not in the trial's own file.
    marker_set : name of a built-in set or a TOML file; found by marker names when not given.
    axes : of the laboratory, as "forward=+x up=+y"; found from the standing trial when not given.
    knee_width, ankle_width, elbow_width : m, for marker sets without medial markers: of both
        sides, or (right, left); what a C3D file knows is used when not given.
    functional : range-of-motion trials, for functional hip centres and knee axes.
    hip_centre : "regression", or "functional" to use functional ones with a small error.
    age : years.
    citation : where the recording is published.
    licence : of the recording.
    consistent : make the smallest change of motion and masses that lowers the residuals.
    kinematics_only : use no forces; moments and forces of the subject's walk are predicted then.
    mirror : fill in a side that no trial shows with the other one's mirror image; it stays marked
        as not recorded, and no walk is judged by it.
    static_time : part of the standing trial, s.
    floor : height of what the person stands on in the standing trial, m.
    feet_flat : whether the feet are flat on the floor in standing.
    no_plate : names of force plates to leave out, as the doubts name them.
    halves : make two trials of the cycles, "odd-even" or "first-last"; the second is not told to
        the subject's walk, which is compared with it.
    """

    forces: Sequence[str | Path] | None
    marker_set: str | None
    axes: str | None
    knee_width: Width
    ankle_width: Width
    elbow_width: Width
    functional: Sequence[str | Path] | None
    hip_centre: HipCentre
    age: float | None
    citation: str
    licence: str
    consistent: bool
    kinematics_only: bool
    mirror: bool
    static_time: tuple[float, float] | None
    floor: float
    feet_flat: bool
    no_plate: Sequence[str] | None
    halves: Halves | None


@dataclass(frozen=True)
class Imported:
    """What an import found and wrote.

    Attributes
    ----------
    files : below the folder, but for `subject.toml`.
    subject_file : of `subject`.
    """

    found: Import
    subject: Subject
    files: tuple[Path, ...]
    subject_file: Path


def import_files(
    static: str | Path | None,
    trials: Sequence[str | Path],
    out: Path,
    *,
    mass: float | None,
    height: float | None,
    sex: str,
    configuration: Configuration,
    tell: Tell = silent,
    **options: Unpack[Options],
) -> Imported:
    """Work out the trials of a session and write everything into a folder.

    A refusal throws nothing away: what was found before it is written, with a page.

    Parameters
    ----------
    static : file of the standing trial; None puts a standing pose together from the first walk.
    trials : files of the walking trials, whose cycles are pooled.
    out : the folder; the subject is named after it.
    mass, height, sex : kg, m, and "F" or "M"; a mass or height of None is taken from the files.
    tell : called with each decision: the step, and a sentence.

    Raises
    ------
    ArtefactError : the folder cannot be written to, or holds a subject that no import wrote.
    SubjectError : a body that cannot be.
    RecordError, ScalingError : see `gaitval.session.session.work_out`.
    """
    check_folder(out)
    progress = Progress()
    stood = Path(trials[0] if static is None else static)
    request = _request(stood, trials, out, (mass, height, sex), options, progress.noting(tell))
    _check_there(request)  # a typing error leaves no folder behind
    with held(Path(out)):
        return _import(Path(out), request, configuration, tell, progress, options)


def _check_there(request: Request) -> None:
    """Raise RecordError, which names all files of a request that are missing."""
    given = (request.static, *request.trials, *request.forces, *request.functional)
    missing = [str(path) for path in dict.fromkeys(given) if not path.exists()]
    if missing:
        raise RecordError(
            f"{', '.join(missing)}: no such file{'s' if len(missing) > 1 else ''}. Check the "
            f"{'paths' if len(missing) > 1 else 'path'}."
        )


def _import(
    out: Path,
    request: Request,
    configuration: Configuration,
    tell: Tell,
    progress: Progress,
    options: Options,
) -> Imported:
    """Work out a request and write what was found, in a folder that is locked."""
    try:
        found = work_out(request, configuration.processing, tell, progress)
    except GaitvalError as error:
        page = write_refusal(out, request, progress, error, configuration.report)
        raise type(error)(f"{error}\nWhat was found before this: {page}").with_way_on(
            *error.goes_on
        ) from None
    files = tuple(write_import(out, found, configuration))
    halves = options.get("halves")
    try:
        subject = _subject(found, options) if halves is None else _of_halves(found, halves, options)
    except GaitvalError as error:
        raise type(error)(
            f"{error}\nEverything else was worked out: {files[0].parent / 'recording.html'}"
        ).with_way_on(*error.goes_on) from None
    return Imported(found, subject, files, write_subject(out, subject))


def _request(
    static: Path,
    trials: Sequence[str | Path],
    out: Path,
    person_given: tuple[float | None, float | None, str],
    options: Options,
    tell: Tell,
) -> Request:
    """What is to be worked out; mass (kg) and height (m) that are not given come from the files."""
    person = person_of_session(
        list(dict.fromkeys([static, *map(Path, trials)])),
        mass_kg=person_given[0],
        height_m=person_given[1],
        sex=person_given[2],
        widths={
            "knee": options.get("knee_width"),
            "ankle": options.get("ankle_width"),
            "elbow": options.get("elbow_width"),
        },
        tell=tell,
    )
    return Request(
        static=static,
        trials=tuple(map(Path, trials)),
        forces=tuple(map(Path, options.get("forces") or ())),
        identifier=_identifier(out),
        mass_kg=person.mass_kg,
        height_m=person.height_m,
        sex=person.sex,
        marker_set=options.get("marker_set"),
        axes=options.get("axes"),
        knee_width_m=person.knee_width_m,
        ankle_width_m=person.ankle_width_m,
        elbow_width_m=person.elbow_width_m,
        without_forces=options.get("kinematics_only", False),
        functional=tuple(map(Path, options.get("functional") or ())),
        hip_centre=options.get("hip_centre", "regression"),
        static_time=options.get("static_time"),
        floor_m=options.get("floor", 0.0),
        feet_flat=options.get("feet_flat", True),
        no_plate=tuple(options.get("no_plate") or ()),
        consistent=options.get("consistent", False),
        mirror=options.get("mirror", False),
    )


def _subject(found: Import, options: Options) -> Subject:
    return subject_of(
        found,
        age_years=options.get("age"),
        citation=options.get("citation", "Own recording, not published"),
        licence=options.get("licence", "not stated"),
    )


def _of_halves(found: Import, which: Halves, options: Options) -> Subject:
    """The subject of one half of the cycles, with the other as a further trial."""
    told, untold = (
        subject.model_copy(update={"source": f"{subject.source} {name}"})
        for name, half in halves_of(found, which).items()
        for subject in [_subject(half, options)]
    )
    return told.with_trial(untold)


def _identifier(out: Path) -> str:
    """A subject's name from the name of its folder."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", out.resolve().name).strip("_")
    return name or "subject"
