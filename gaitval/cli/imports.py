"""The command that imports many people's recordings."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.errors import ToleranceError
from gaitval.terminal import display
from gaitval.terminal.app import ConfigOption, SetOption, added_command


@added_command(
    "gaitval imports session.toml --out reports/lab",
    "gaitval imports recordings/ --out reports/lab     # every session.toml in a folder",
    "gaitval imports OpenCapData_f2/ --out reports/lab   # or a session of OpenCap or Pose2Sim",
    after="subjects",
)
def imports(
    sessions: Annotated[
        Path,
        typer.Argument(metavar="FILE|FOLDER", help="Session file, or a folder of them."),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="Folder; each person gets one in it."),
    ],
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Turn the recordings of many people into subjects, one after the other.

    A session file is TOML with a table [[people]] for each: name, sex, static, trials (a list),
    and any option of `gaitval import` (mass, height, forces, knee_width = [right, left], ...).
    Paths are relative to the file. One that is refused does not stop the others: a table at the
    end, and OUT/batch.csv, say what became of each. The exit code is 2 if any was refused,
    else 1 if forces of any were given and no moments came of them.
    """
    from gaitval.configuration import load_configuration
    from gaitval.importing.batch_imports import TABLE, import_batch, read_batch

    people = read_batch(sessions, lambda _, text: display.plain(text))
    configuration = load_configuration(config, settings=settings or ())
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
