"""The command that lays two sessions of one person over each other."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command


@added_command(
    "gaitval change reports/before reports/after --out change      # two imports",
    "gaitval change reports/before runs/S05 --out change           # an import, a study's record",
    "gaitval change runs/plain runs/shoes --walks                  # the walks of two studies",
    after="report",
)
def change(
    before: Annotated[Path, typer.Argument(metavar="BEFORE")],
    after: Annotated[Path, typer.Argument(metavar="AFTER")],
    walks: Annotated[
        bool, typer.Option("--walks", help="Of studies, their walks instead of their records.")
    ] = False,
    same_person: Annotated[
        bool,
        typer.Option(
            "--same-person", help="It is one person, although stature, mass or name differ."
        ),
    ] = False,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the report.")] = Path(
        "change"
    ),
) -> None:
    """Lay two sessions of one person over each other, and say what changed.

    BEFORE and AFTER are folders of `gaitval import` or of studies. A change counts where the gait
    cycles of the sessions differ, by one test of all curves, and by more than putting the markers
    on again would change. Writes OUT/change.html, change.pdf, change.json and tables as CSV.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.changes.change import CHANGED, change_between, headline
    from gaitval.apps.changes.visits import read_visit
    from gaitval.apps.changes.write import write_change

    found = change_between(
        read_visit(before, walk=walks), read_visit(after, walk=walks), same_person=same_person
    )
    with locked(out):
        result = write_change(found, out)
    for line in (result.speed, headline(found), *result.notes):
        if line:
            display.plain(line)
    said = [region.words for _, region in found.findings() if region.level in CHANGED]
    for line in said:
        display.plain(f"{line}.")
    display.plain(f"Page: {out}/change.html")
