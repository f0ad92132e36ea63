"""The command that says what a record says about a body."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitval.errors import ArtefactError, SubjectError
from gaitval.terminal import display
from gaitval.terminal.app import ConfigOption, SetOption, SubjectArgument, added_command

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject


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
            help="Import with --functional: its hips and knees count as measured.",
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
    from dataclasses import replace

    from gaitval.artefacts import write_json
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.identification.begin import begin
    from gaitval.identification.body_words import sentences
    from gaitval.identification.joints import legs_of_session, with_joints
    from gaitval.identification.offsets import offset_of
    from gaitval.identification.plausible import implausible
    from gaitval.identification.pooled import pooled
    from gaitval.identification.prior import measured_by, prior_sd
    from gaitval.identification.shared_errors import NAMES, identified
    from gaitval.identification.verdicts import judged
    from gaitval.importing.stored import Session
    from gaitval.model.parameters import nominal_parameters
    from gaitval.one_thread import one_thread
    from gaitval.reference.dynamic_fit import consistent_reference
    from gaitval.reporting.body_page import tables, write_body_page
    from gaitval.scaling.scaling import scale_subject

    configuration = load_configuration(config, settings=settings or ())
    configuration = configuration.model_copy(
        update={
            "identification": configuration.identification.model_copy(
                update={"parameters": "paper"}
            )
        }
    )
    person = load_subject(subject)
    for warning in implausible(person, configuration, person.record()):
        display.messages.print(f"Warning: {warning}")
    model = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    if trials and not person.trials:
        raise SubjectError(
            f"{person.identifier} has one trial, so there are none to take with it. Leave --trials "
            "out, or add the others to its file, each under [[trials]]."
        )
    others = [person.on_trial(each.name) for each in person.trials] if trials else []
    each_trial = []
    for own in (person, *others):
        record = own.record()
        with one_thread():
            near = consistent_reference(record, model, configuration.contact)
            fit, held = begin(
                record, model, prior_sd(person), configuration, own.has_kinetics, near
            )
            each_trial.append(identified(fit, held, offset_of(person)))
    found = pooled(each_trial) if others else each_trial[0]
    if session is not None:
        if measured_by(person)["thigh_length"] != "markers":
            raise ArtefactError(
                f"{person.identifier} was not scaled by markers, so the hips and knees of "
                f"{session} are not about its body. Give the subject.toml that this import wrote."
            )
        stored = Session.load(session).record
        _check_same(person, stored["person"], session)
        legs = legs_of_session(stored, str(session))
        found = replace(found, posterior=with_joints(found.posterior, model, legs))
    said, shown = sentences(found, model), tables(found, model)
    display.plain(said)
    for title, rows in shown:
        display.print_rows(rows, f"{person.identifier}: {title}")
    if page is not None:
        display.plain(f"Page: {write_body_page(page, person.identifier, found, model)}")
    if out is None:
        return
    posterior, bought = found.posterior, shown[-1][1]
    write_json(
        out,
        {
            "said": said,
            "parameters": {
                each.name: {"scaled": float(scaled), "expected": each.prior_mean,
                            "prior_sd": each.prior_sd, "found": each.mean, "sd": each.sd,
                            "verdict": each.verdict}
                for each, scaled in zip(judged(posterior), nominal_parameters(), strict=True)
            },
            "left_leg_longer_m": {
                **dict(zip(("mean", "sd"), found.legs.estimate, strict=True)),
                "odds_of_more_than_people_s": found.legs.odds,
                "more_than_people_s": found.legs.differ,
            },
            "errors": {
                name: {"mean": float(value), "sd": float(sd)}
                for name, value, sd in zip(NAMES, found.values, found.sd, strict=True)
            },
            "trials": [dict(zip(bought[0], row, strict=True)) for row in bought[1:]],
        },
    )  # fmt: skip
    display.plain(f"Body: {out}")


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
