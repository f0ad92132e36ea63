"""The command that says what a record says about a body."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitval.errors import ArtefactError
from gaitval.terminal import display
from gaitval.terminal.app import ConfigOption, SetOption, SubjectArgument, added_command

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject
    from gaitval.identification.shared_errors import Shared
    from gaitval.model.body import BodyModel


@added_command(
    "gaitval body 5", "gaitval body 5 --out body.json --page body.html", after="subjects"
)
def body(
    subject: SubjectArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write all of it as JSON.")
    ] = None,
    page: Annotated[
        Path | None, typer.Option("--page", metavar="FILE", help="Write all of it as HTML.")
    ] = None,
    session: Annotated[
        Path | None,
        typer.Option(
            "--session",
            metavar="FOLDER",
            help="Import with range-of-motion trials: its hips and knees count as measured.",
        ),
    ] = None,
    trials: Annotated[
        bool,
        typer.Option("--trials", help="With the person's further trials (`trials` in the file)."),
    ] = False,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """What a record says about a person's body, if skin moves with the joints and the belt errs.

    First in two sentences: how long the legs are, and whether they differ. Then each parameter as
    scaled and as found, what seems wrong with angles and belt, and what a further trial would add.
    Warns if mass, speed and lengths cannot be one person's. No policy has a part in it, and no run
    is changed. About ten seconds a trial.
    """
    from gaitval._internal.io.artefacts import write_json
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.identification.body_of_record import body_of_record
    from gaitval.identification.body_words import sentences
    from gaitval.identification.plausible import implausible
    from gaitval.reporting.body_page import as_dict, tables, write_body_page
    from gaitval.scaling.scaling import scale_subject

    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(subject)
    for warning in implausible(person, configuration, person.record()):
        display.messages.print(f"Warning: {warning}")
    model = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    found = body_of_record(person, model, configuration, further_trials=trials)
    if session is not None:
        found = _with_measured_joints(found, person, model, session)
        display.plain(
            f"Counted as measured: the functional hips and knees of {session}. A range-of-motion "
            "trial in the last table is one more."
        )
    display.plain(sentences(found, model))
    for title, rows in tables(found, model):
        display.print_rows(rows, f"{person.identifier}: {title}")
    if page is not None:
        display.plain(f"Page: {write_body_page(page, person.identifier, found, model)}")
    if out is not None:
        write_json(out, as_dict(found, model))
        display.plain(f"Body: {out}")


def _with_measured_joints(
    found: "Shared", person: "Subject", model: "BodyModel", session: Path
) -> "Shared":
    """What was `found`, and the functional hips and knees of the import in the folder `session`."""
    from dataclasses import replace

    from gaitval.identification.joints import legs_of_session, with_joints
    from gaitval.identification.prior import measured_by
    from gaitval.importing.stored import Session

    if measured_by(person)["thigh_length"] != "markers":
        raise ArtefactError(
            f"{person.identifier} was not scaled by markers, so the hips and knees of "
            f"{session} are not about its body. Give the subject.toml that this import wrote."
        )
    stored = Session.load(session).record
    _check_same(person, stored["person"], session)
    legs = legs_of_session(stored, str(session))
    return replace(found, posterior=with_joints(found.posterior, model, legs))


def _check_same(person: "Subject", other: Mapping[str, Any], session: Path) -> None:
    """Raise ArtefactError if a `session` is of another person, `other`."""
    pairs = {
        "mass, kg": (person.mass_kg, other["mass_kg"]),
        "stature, m": (person.height_m, other["height_m"]),
        "sex": (person.sex, other["sex"]),
    }
    differ = [
        f"{what}: {ours} and {theirs}" for what, (ours, theirs) in pairs.items() if ours != theirs
    ]
    if differ:
        raise ArtefactError(
            f"{session} is a session of somebody else than {person.identifier} "
            f"({'; '.join(differ)}). Give the subject.toml that this import wrote."
        )
