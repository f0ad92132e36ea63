"""The command that says what a record says about a body."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import ConfigOption, SetOption, SubjectArgument, added_command


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
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """What a record says about a person's body, if skin moves with the joints and the belt errs.

    First in two sentences: how long the legs are, and whether they differ. Then each parameter as
    scaled and as found, and what seems wrong with angles and belt.
    Warns if mass, speed and lengths cannot be one person's. No policy has a part in it, and no run
    is changed. About ten seconds.
    """
    from gaitval._internal.io.artefacts import write_json
    from gaitval.configuration import load_configuration
    from gaitval.identification.body_of_record import body_of_record
    from gaitval.identification.body_words import sentences
    from gaitval.identification.plausible import implausible
    from gaitval.reporting.body_page import as_dict, tables, write_body_page
    from gaitval.scaling.scaling import scale_subject
    from gaitval.subjects.subject_file import load_subject

    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(subject)
    for warning in implausible(person, configuration, person.record()):
        display.messages.print(f"Warning: {warning}")
    model = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    found = body_of_record(person, model, configuration)
    display.plain(sentences(found, model))
    for title, rows in tables(found, model):
        display.print_rows(rows, f"{person.identifier}: {title}")
    if page is not None:
        display.plain(f"Page: {write_body_page(page, person.identifier, found, model)}")
    if out is not None:
        write_json(out, as_dict(found, model))
        display.plain(f"Body: {out}")
