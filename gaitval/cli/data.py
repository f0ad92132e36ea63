"""Commands of the published data sets: what there is, and their download."""

from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import Added, Command, Group

data_app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
    pretty_exceptions_enable=False,
    help="List and download published data sets; copy the samples.",
)
data = Added(data_app, after="subjects")

FolderOption = Annotated[
    Path | None,
    typer.Option("--folder", help="Folder of the data; by default the user's cache."),
]


@data_app.command(
    "list",
    cls=Command,
    help="List the data sets that can be fetched, and which parts are on this machine."
    "\n\n\b\nExamples:\n  gaitval data list",
)
def data_list(folder: FolderOption = None) -> None:
    """List the data sets."""
    from gaitval.subjects.archive import default_folder, missing, registry

    folder = folder or default_folder()
    for dataset in registry().values():
        lacking = missing(dataset, folder)
        display.output.print(Text(dataset.name, style="bold"), "", dataset.title)
        display.output.print(
            f"  {dataset.size / 1e9:.2f} GB, {dataset.licence}, doi:{dataset.doi}\n"
            f"  {dataset.citation}\n  {folder / dataset.name}: "
            f"{'missing: ' + ', '.join(lacking) if lacking else 'complete'}",
        )


@data_app.command(
    "fetch",
    cls=Command,
    help="Download a data set by its DOI, verify it and unpack it."
    "\n\n\b\nExamples:\n  gaitval data fetch wbds\n  gaitval data fetch wbds --folder /data",
)
def data_fetch(
    name: Annotated[str, typer.Argument(help="Name of the data set, see `gaitval data list`.")],
    folder: FolderOption = None,
) -> None:
    """Download a data set."""
    from gaitval.subjects.archive import fetch

    with display.messages.status(f"Downloading {name}, verifying and unpacking it"):
        files = fetch(name, folder)
    for file in files:
        display.output.print(f"{file}: here, and its hash is the published one", soft_wrap=True)


@data_app.command(
    "sample",
    cls=Command,
    help="Copy the samples: markers and force plates of a virtual person, as C3D, with the true "
    "angles and moments beside them; and a table of strides for `gaitval patients`. They come "
    "with gaitval; nothing is downloaded."
    "\n\n\b\nExamples:\n  gaitval data sample\n  gaitval data sample recordings/sample",
)
def data_sample(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Where to copy it.")] = Path(
        "sample"
    ),
) -> None:
    """Copy the samples."""
    from gaitval._internal.io.artefacts import read_json
    from gaitval.subjects.sample import copy_sample, import_line, patients_line

    files = copy_sample(folder)
    size = sum(file.stat().st_size for file in files)
    display.plain(f"{folder}: {', '.join(file.name for file in files)} ({size / 1e3:.0f} kB)")
    line = import_line(folder, read_json(folder / "truth.json"))
    display.plain(f"Import it: {line}")
    display.plain(f"Its strides: {patients_line(folder)}")
