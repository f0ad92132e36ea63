"""Commands of recorded data: the built-in subjects, and an import."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import (
    CommandFunction,
    ConfigOption,
    ExtensorOption,
    SetOption,
    command,
    with_looks,
)
from gaitval.coordinates import SIDES

if TYPE_CHECKING:
    from gaitval.configuration import Configuration
    from gaitval.session.importing.importing import Imported


@command("gaitval subjects")
def subjects() -> None:
    """List the built-in subjects."""
    from gaitval.subjects.subject_file import builtin_subjects

    table = Table(
        *("subject", "person, trial", "sex", "age", "mass kg", "height m", "speed m/s"),
        title="Built-in subjects (Fukuchi, Fukuchi & Duarte 2018, CC BY 4.0)",
    )
    for person in builtin_subjects():
        table.add_row(
            person.identifier,
            person.source,
            person.sex,
            "" if person.age_years is None else f"{person.age_years:g}",
            f"{person.mass_kg:g}",
            f"{person.height_m:g}",
            f"{person.walking_speed_m_s:g}",
        )
    display.output.print(table)


def _with_import_options(function: CommandFunction) -> CommandFunction:
    from gaitval.cli.terminal.model_options import with_fields
    from gaitval.session.request import ImportOptions

    return with_fields(function, ImportOptions, may_lack=True)


@command(
    "gaitval import --static stand.c3d --trial walk.c3d --mass 74.3 --height 1.725 --sex M "
    "--out reports/mine",
    "gaitval import --static stand.trc --trial walk.trc --forces walk_grf.mot --mass 85 "
    "--height 1.83 --sex M --out reports/theirs",
    "gaitval subject reports/mine/subject.toml      # then the main job, as for a built-in subject",
    "gaitval import session.toml --out reports/lab   # many recordings; or every session.toml in a "
    "folder, or a session of OpenCap or Pose2Sim",
    name="import",
    complete=_with_import_options,
)
def import_command(
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "-o",
            help="Folder; the subject is named after it. Of sessions, each person gets one in it.",
        ),
    ],
    sessions: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE|FOLDER", help="Session files, or folders of them."),
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    extensor_positive: ExtensorOption = None,
    **options: Any,
) -> None:
    r"""Turn a laboratory's own recordings into a subject: OUT/subject.toml, OUT/recording.

    Finds the axes and the marker set, cleans the markers, scales the body and fits it to the
    standing and the walking trial, and works out joint angles (inverse kinematics), joint moments
    (inverse dynamics with the measured ground reaction) and the mean gait cycle. Prints what it
    decides. OUT/recording holds a page (recording.html, recording.pdf), tables (CSV, JSON) and
    the model, motion, moments and forces as OpenSim files. Exit code 1 if forces were
    given and no moments came of them, so that they are not judged; the subject is made of angles.

    A session file has many recordings: TOML with a table \[\[people]] for each, with name, sex,
    trials (a list) and any other option as a key (static, mass, ...).
    Paths are relative to the file. One that is refused does not stop the others: a table at the
    end, and OUT/batch.csv, say what became of each. The exit code is 2 if any was refused.
    """
    from gaitval.cli.terminal.model_options import flag_of
    from gaitval.configuration import load_configuration
    from gaitval.errors import ToleranceError, TrialOnlyError
    from gaitval.session.importing.importing import import_files
    from gaitval.session.request import ImportOptions, checked

    settings = with_looks(settings, extensor_positive=extensor_positive)
    if sessions:
        _refuse_recordings(sessions, options)
        _import_sessions(sessions, out, load_configuration(config, settings=settings))
        return
    # errors name the flag that the user typed, not the field
    given = checked(ImportOptions, options, shown=lambda name: flag_of(ImportOptions, name))
    try:
        with display.live_view() as live:
            imported = import_files(
                given,
                out,
                configuration=load_configuration(config, settings=settings),
                notify=lambda step, text: live.say(f"{step}: {text}"),
            )
    except TrialOnlyError as only:
        display.plain(f"Made: {only}")
        return
    say_what_was_made(imported, out)
    from gaitval.session.importing.summary import not_judged

    if reason := not_judged(imported.found):
        raise ToleranceError(
            f"Not judged: {reason}. The limits that passed are those of the markers. "
            "The subject is made of angles, and can be used. Give a trial with a whole stance on a "
            "plate, or --kinematics-only if forces do not matter."
        )


def _refuse_recordings(sessions: list[Path], options: dict[str, Any]) -> None:
    """Refuse a recording among session files, or what is given of one beside them."""
    from gaitval.cli.terminal.model_options import flag_of
    from gaitval.errors import ConfigurationError
    from gaitval.session.request import ImportOptions

    strays = [path for path in sessions if path.suffix.lower() != ".toml" and not path.is_dir()]
    if strays:
        trials = [
            f"--trial {shlex.quote(str(path))}" for path in (*(options["trials"] or ()), *strays)
        ]
        raise ConfigurationError(
            f"{', '.join(map(str, strays))}: a recording without its option; only session files "
            f"(.toml) and folders go without. If it is a walking trial write {' '.join(trials)}, "
            "else --static or --forces before it."
        )
    given = [
        flag_of(ImportOptions, name)
        for name, value in options.items()
        if value not in (None, [], ImportOptions.model_fields[name].default)
    ]
    if given:
        raise ConfigurationError(
            f"{', '.join(given)}: of one recording, but session files are given. Write it into "
            "them, as a key of each person whom it is of, or leave the session files out."
        )


def _import_sessions(sessions: list[Path], out: Path, configuration: "Configuration") -> None:
    """Import the people of `sessions`, one after the other; print a table of what became of each.

    Raises typer.Exit if one was refused, ToleranceError if forces of one were not judged.
    """
    from gaitval.errors import ToleranceError
    from gaitval.session.importing.batch_imports import TABLE, import_batch, read_batch

    people = read_batch(sessions, lambda _, text: display.plain(text))
    with display.live_view() as live:
        outcomes = import_batch(
            people,
            out,
            configuration,
            notify=lambda name, step, text: live.say(f"{name}: {step}: {text}"),
        )
    display.print_csv(out / TABLE, "Imports")
    if not all(outcome.made for outcome in outcomes):
        raise typer.Exit(2)
    if unjudged := [outcome.name for outcome in outcomes if outcome.not_judged]:
        raise ToleranceError(
            f"Not judged: {', '.join(unjudged)}: see the column not_judged of {out / TABLE}. The "
            "subjects were made of angles, and can be used."
        )


def say_what_was_made(imported: "Imported", out: Path) -> None:
    """Print tables, files, next steps, warnings and failures of `imported`, made into `out`."""
    from gaitval.session.importing.files import FOLDER

    display.print_import(imported.found)
    page = out / FOLDER / "recording.html"
    display.plain(f"Page: {page} (files beside it: {len(imported.files)})")
    path = imported.subject_file
    # a prosthesis, and legs of unlike length, keep them apart by themselves
    chosen = imported.found.body.chosen
    wanted = not (chosen.symmetric or chosen.legs_differ or imported.subject.prosthesis in SIDES)
    two = " --set scaling.symmetric=false" if wanted else ""
    display.plain(f"Subject: {path}; continue with: gaitval subject {shlex.quote(str(path))}{two}")
    display.print_warnings(imported.found)
    display.print_import_verdict(imported.found)
