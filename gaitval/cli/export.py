"""The command that writes a stored walker in other tools' formats."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import WalkerArgument, added_command


@added_command(
    "gaitval export 5 --to mujoco --out walker      # then: python walker/walk.py --cycles 100",
    "gaitval export 5 --to gymnasium --out training",
    "gaitval export reports/S05 --to opensim --out S05-opensim",
    after="report",
)
def export(
    walker: WalkerArgument,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help="mujoco, urdf, gymnasium, opensim or c3d.",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", metavar="FOLDER", help="Folder to write."),
    ],
) -> None:
    """Write the scaled person and the validated walk for another tool.

    mujoco: a model and a script that walks in plain MuJoCo. urdf: the body for robot simulators,
    and the walk as a table. gymnasium: an environment that plain stable-baselines3 trains in.
    opensim: model, motion, moments and loads. c3d: virtual markers and force plates. The first use
    on a machine takes a minute, later ones half of it.
    """
    from gaitval._internal.io.folder_lock import check_links
    from gaitval.apps.export.formats import export_to, writer_of
    from gaitval.apps.export.walked import ExportedWalk

    writer_of(to)  # a name that is none is refused before anything is computed
    check_links(out)
    display.messages.print(f"Reading the walker of {walker} ...")
    found = ExportedWalk.of(walker)
    display.messages.print(f"{found.stored.subject.identifier}, from {found.stored.folder}.")
    paths = export_to(to, out, found, display.messages.print)
    display.plain(f"{out}: {', '.join(str(path.relative_to(out)) for path in paths)}")
