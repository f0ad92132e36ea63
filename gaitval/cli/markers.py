"""The command that drafts a marker set."""

import os
import shlex
from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command
from gaitval.errors import RecordError


@added_command(
    "gaitval markers stand.c3d     # stand_markers.toml",
    "gaitval markers walk.trc --out my_laboratory.toml",
    after="subjects",
)
def markers(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Trial with all markers, such as the standing one."),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE.toml", help="Marker set to write."),
    ] = None,
) -> None:
    """Draft a marker set from the names of the markers.

    Reads sides and places from the names, in several languages and systems, writes the set, and
    prints the command that goes on. A marker whose name says no place, or several, is written as a
    comment for you to fill in. Where the markers are is not looked at: correct the set.
    """
    from gaitval._internal.io.artefacts import write_text
    from gaitval.mocap.reading import read_recording
    from gaitval.scaling.markers.draft import draft_of

    target = out or Path(f"{file.stem}_markers.toml")
    if target.suffix != ".toml":
        raise RecordError(f"--out {target}: the name of a marker set ends in .toml.")
    if os.path.exists(target):  # False also for a name that is too long
        raise RecordError(
            f"{target} is there, and may have been corrected by hand. Give another --out, or "
            "remove it."
        )
    names = read_recording(file, plates=False).names
    draft = draft_of(names)
    title = f"Markers of {file.name}"
    write_text(target, draft.as_toml(title, "drafted by gaitval markers"))
    display.plain(
        f"{len(draft.sure)} of {len(names)} markers have a name that says one place; "
        f"{len(draft.unsure)} are comments in {target}, for you to fill in."
    )
    going_on = ["gaitval", "import", "--static", "STAND", "--trial", "WALK", "--marker-set"]
    display.plain(
        f"Look at it, correct it, and go on with: {shlex.join([*going_on, str(target)])} --mass KG "
        "--height M --sex F|M --out FOLDER"
    )
