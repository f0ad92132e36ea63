"""An import from what a user gives to the files of a folder, for the command and for Python."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gaitval._internal.io.folder_lock import locked
from gaitval.arrays import runs
from gaitval.configuration import Configuration, ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.errors import (
    ConfigurationError,
    GaitvalError,
    NoCycleError,
    TrialOnlyError,
)
from gaitval.session.importing.files import SUBJECT
from gaitval.session.importing.person import check_texts, check_there, person_of_session
from gaitval.session.importing.write import check_folder, write_import, write_subject
from gaitval.session.measurement.correct import wanted
from gaitval.session.measurement.halves import subject_of_halves
from gaitval.session.measurement.measured import measured
from gaitval.session.request import FILES, ImportOptions, Notify, Request, silent
from gaitval.session.session import Import, ImportProgress, work_out_trials
from gaitval.session.subject import subject_of
from gaitval.session.trial import WalkingTrial
from gaitval.subjects.subject import Subject


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


def work_out(
    request: Request,
    processing: ProcessingSettings,
    notify: Notify = silent,
    progress: ImportProgress | None = None,
    *,
    symmetric: bool = True,
) -> Import:
    """Everything from the files of `request` to the mean gait cycle, as `work_out_trials`, and what
    forces and markers say of each other's faults, with bands.
    """
    found = work_out_trials(request, processing, notify, progress, symmetric=symmetric)
    return measured(found, notify)


def import_files(
    options: ImportOptions, out: Path, *, configuration: Configuration, notify: Notify = silent
) -> Imported:
    """Work out the trials of a session (`options`) and write everything into the folder `out`.

    A refusal throws nothing away: what was found before it is written, with a page. The subject is
    named after the folder; `configuration` has the constants; `notify` is called with each
    decision: the step, and a sentence.

    Raises
    ------
    ConfigurationError : motion or plates are to be changed by forces that an aid shares.
    ArtefactError : the folder cannot be written to, or holds a subject that no import wrote.
    SubjectError : a body that cannot be.
    RecordError, ScalingError : see `gaitval.session.session.work_out_trials`.
    TrialOnlyError : a trial without a whole gait cycle, whose poses and moments are written.
    """
    out = Path(out)
    check_folder(out)
    progress = ImportProgress()
    request = request_of(options, out, progress.noting(notify))
    # A typing error leaves no folder behind.
    of_lists = [path for name in FILES for path in getattr(request, name)]
    model = [] if request.scaled_model is None else [request.scaled_model]
    check_there([request.static, *of_lists, *model])
    check_texts(request)
    if request.aid is not None and (request.consistent or request.correct):
        raise ConfigurationError(
            f"--{'consistent' if request.consistent else 'correct'} with aid = {request.aid!r}: "
            "what the aid carries is not measured, and would be taken for an error of masses, "
            "motion or plates. Leave one of them out."
        )
    if request.correct:
        wanted(request.correct)
    with locked(out):
        return _import(out, request, configuration, notify, progress)


def _import(
    out: Path,
    request: Request,
    configuration: Configuration,
    notify: Notify,
    progress: ImportProgress,
) -> Imported:
    """Work out a request and write what was found, in a folder that is locked."""
    try:
        # as `scale_subject` has it of the subject that comes of this
        symmetric = configuration.scaling.symmetric and request.prosthesis not in SIDES
        found = work_out(request, configuration.processing, notify, progress, symmetric=symmetric)
    except GaitvalError as error:
        from gaitval.session.importing.refusal import EARLIER, write_refusal

        had = (out / SUBJECT).exists()
        page = write_refusal(out, request, progress, error, configuration.report)
        if isinstance(error, NoCycleError) and (parts := trial_parts(progress.trials)):
            raise TrialOnlyError(
                f"{_kind(progress.trials)}: {parts}. No subject is made of it, for a "
                f"walk needs a whole gait cycle: {error}\nThe trial: {page}"
            ) from None
        message = f"{error}\nWhat was found before this: {page}"
        message += f"\nThe subject of the import before is kept: {out / EARLIER}" if had else ""
        raise type(error)(message).with_way_on(*error.goes_on) from None
    files = tuple(write_import(out, found, configuration))
    try:
        if request.halves is None:
            subject = subject_of(found)
        else:
            subject = subject_of_halves(found, request.halves)
    except GaitvalError as error:
        page = files[0].parent / "recording.html"
        raise type(error)(f"{error}\nEverything else was worked out: {page}").with_way_on(
            *error.goes_on
        ) from None
    return Imported(found, subject, files, write_subject(out, subject))


def _kind(trials: Sequence[WalkingTrial]) -> str:
    return f"trial with {'poses' if all(walk.moments is None for walk in trials) else 'moments'}"


LEAST_PART_S: Final = 0.25
"""s. Moments that are known for a shorter time at once are of no use to anybody."""


def trial_parts(trials: Sequence[WalkingTrial]) -> str:
    """When each leg's moments are known in the trials, or their poses without forces; empty where
    nothing is known.
    """
    message = []
    for walk in trials:
        time, parts = walk.recording.time, []
        for side in SIDES:
            if walk.moments is None:
                continue
            times = [
                f"{time[begin]:.2f} to {time[end - 1]:.2f} s"
                for begin, end in zip(*runs(walk.moments.leg_known(side)), strict=True)
                if time[end - 1] - time[begin] >= LEAST_PART_S
            ]
            if times:
                parts.append(f"moments of the {side} leg from {' and '.join(times)}")
        if walk.loads is None and walk.kinematics.determined.any():
            parts.append(f"poses from {time[0]:.2f} to {time[-1]:.2f} s")
        if parts:
            message.append(f"{walk.name}: {', '.join(parts)}")
    return "; ".join(message)


def request_of(options: ImportOptions, out: Path, notify: Notify) -> Request:
    """What is to be worked out, into `out`: what the `options` do not give of the person comes from
    the files, and `notify` says so.
    """
    known = person_of_session(options, notify)
    static = options.trials[0] if options.static is None else options.static
    given = {name: getattr(options, name) for name in ImportOptions.model_fields}
    folder = re.sub(r"[^A-Za-z0-9_-]+", "_", out.resolve().name).strip("_")
    about = {"static": static, "identifier": folder or "subject"}
    request = Request.model_validate(given | known._asdict() | about)
    person, laboratory, guessed = request.who
    say_so = "Say so with person and laboratory in a session file"
    assumed = f"; assumed: {guessed}. {say_so}" if guessed else ""
    age = None if request.age is None else f"{request.age:g}"
    message = [("age", age), ("prosthesis", request.prosthesis), ("aid", request.aid)]
    also = "".join(f", {name} {value}" for name, value in message if value is not None)
    notify("person", f"{person} of laboratory {laboratory}, trial {request.trial}{also}{assumed}")
    return request
