"""The samples that come with gaitval: a recording of a virtual person whose motion is known, and a
table of strides of three virtual people.

`gaitval/samples/README.md` says how it was made.
"""

from importlib import resources
from pathlib import Path
from shlex import quote
from typing import Any, Final

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import replacing
from gaitval.errors import ArchiveError

SAMPLE: Final = (
    *("standing.c3d", "walking.c3d", "truth.csv", "truth.json"),
    *("strides.csv", "people.csv", "README.md"),
)
"""Its files."""


def copy_sample(folder: Path) -> list[Path]:
    """Copy the sample into `folder`; returns the files there. Raises ArchiveError if a file of one
    of these names is there already and is another, ArtefactError if the folder cannot be written
    to.
    """
    contents = {
        name: resources.files("gaitval").joinpath("samples", name).read_bytes() for name in SAMPLE
    }
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise ArchiveError(f"{folder}: is a file. Give a folder.")
    for name, content in contents.items():
        there = folder / name
        if not there.exists():
            continue
        if file_gate.read_bytes(there, ArchiveError, largest=file_gate.SIZES.binary) != content:
            raise ArchiveError(
                f"{there}: is there already and is not the sample's. Give another folder."
            )
    for name, content in contents.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(content)
    return [folder / name for name in SAMPLE]


PROCESSING: Final = (
    "--set processing.marker_cutoff_hz=7 --set processing.moment_force_cutoff_hz=7 --consistent"
)
"""The simulated heel strike is harder than a person's: at 8 Hz its residual moment, 2 % of the
height of the centre of mass times peak force, misses the limit of 1 %; made consistent at 7 Hz it
has 0.8 %."""


def import_line(folder: Path, about: dict[str, Any]) -> str:
    """The command that imports the sample's recording in `folder`; `about` is what its `truth.json`
    holds.
    """
    static, trial = (quote(str(folder / f"{name}.c3d")) for name in ("standing", "walking"))
    files = f"--static {static} --trial {trial}"
    person = f"--mass {about['mass_kg']:g} --height {about['height_m']:g} --sex {about['sex']}"
    out = quote(str(Path("reports") / folder.name))
    belt = f"--belt {about['belt_m_s']:.4f}"
    return f"gaitval import {files} {person} {belt} {PROCESSING} --out {out}"


def patients_line(folder: Path) -> str:
    """The command that makes subjects of the strides of the sample in `folder`."""
    strides, people = (quote(str(folder / f"{name}.csv")) for name in ("strides", "people"))
    given = f"--people {people} --healthy virtual_healthy"
    return f"gaitval patients {strides} {given} --out runs/patients"
