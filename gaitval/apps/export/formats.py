"""The formats by name, and what writes each."""

import os
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.text.any_case import as_known
from gaitval.apps.export.c3d_file import write_c3d_file
from gaitval.apps.export.mujoco_folder import write_mujoco
from gaitval.apps.export.opensim_folder import write_opensim
from gaitval.apps.export.urdf_folder import write_urdf_folder
from gaitval.apps.export.walked import ExportedWalk
from gaitval.errors import ArtefactError, ConfigurationError

_Notify = Callable[[str], None]
_Writer = Callable[[Path, ExportedWalk], list[Path]]
"""Writes files into a folder, which it makes; returns their paths. Raises ArtefactError."""


def write_training(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `walker/`, which `gaitval/Walker-v0` takes, and `train.py`; returns the paths of all
    files. Raises ArtefactError.
    """
    walker, script = folder / "walker", folder / "train.py"
    walked.stored.save(walker)
    write_text(script, files("gaitval.apps.export").joinpath("train.py").read_text("utf-8"))
    return [*sorted(path for path in walker.rglob("*") if path.is_file()), script]


FORMATS: Final[dict[str, _Writer]] = {
    "mujoco": write_mujoco,
    "urdf": write_urdf_folder,
    "gymnasium": write_training,
    "opensim": write_opensim,
    "c3d": write_c3d_file,
}


def export_to(
    name: str, folder: Path, walked: ExportedWalk, notify: _Notify = lambda text: None
) -> list[Path]:
    """Write a format by its `name` of what was `walked` into `folder`; returns the paths of its
    files. `notify` takes a line before each step that takes seconds. Raises ConfigurationError if
    there is no such format, ArtefactError if the folder cannot be made or written to.
    """
    if os.path.exists(folder) and not folder.is_dir():  # False also for a name that is too long
        raise ArtefactError(
            f"--out {folder}: is a file, but an export is a folder of files. Give another name."
        )
    write = writer_of(name)
    notify("Making its simulation ready ...")
    walked.environment  # noqa: B018
    notify(f"Writing {name} ...")
    return write(folder, walked)


def writer_of(name: str) -> _Writer:
    """What writes a format by its name. Raises ConfigurationError for others."""
    name = as_known(name, FORMATS)
    if name not in FORMATS:
        raise ConfigurationError(
            f"--to {name}: not a format that gaitval writes. Give one of {', '.join(FORMATS)}."
        )
    return FORMATS[name]
