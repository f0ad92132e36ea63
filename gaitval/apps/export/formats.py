"""The formats by name, and what writes each."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from gaitval.apps.export.biomod import write_biomod
from gaitval.apps.export.c3d_file import write_c3d_file
from gaitval.apps.export.crate import write_crate
from gaitval.apps.export.locohub import write_locohub
from gaitval.apps.export.mujoco_folder import write_mujoco
from gaitval.apps.export.opensim_folder import write_opensim
from gaitval.apps.export.training_folder import write_training
from gaitval.apps.export.walked import ExportedWalk
from gaitval.errors import ArtefactError, ConfigurationError

_Writer = Callable[[Path, ExportedWalk], list[Path]]
"""Writes files into a folder, which it makes; returns their paths. Raises ArtefactError."""

FORMATS: Final[dict[str, _Writer]] = {
    "mujoco": write_mujoco,
    "gymnasium": write_training,
    "opensim": write_opensim,
    "c3d": write_c3d_file,
    "biomod": write_biomod,
    "locohub": write_locohub,
}


def _bundle(folder: Path, walked: ExportedWalk) -> list[Path]:
    parts = {name: write(folder / name, walked) for name, write in FORMATS.items()}
    return write_crate(folder, walked, parts)


def export_to(name: str, folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write a format by its `name` of what was `walked` into `folder`; returns the paths of its
    files. Raises ConfigurationError if there is no such format, ArtefactError if the folder cannot
    be made or written to.
    """
    if os.path.exists(folder) and not folder.is_dir():  # False also for a name that is too long
        raise ArtefactError(
            f"--out {folder}: is a file, but an export is a folder of files. Give another name."
        )
    return writer_of(name)(folder, walked)


def writer_of(name: str) -> _Writer:
    """What writes a format by its name. Raises ConfigurationError for others."""
    writers = FORMATS | {"bundle": _bundle}
    if name not in writers:
        raise ConfigurationError(
            f"--to {name}: not a format that gaitval writes. Give one of "
            f"{', '.join(FORMATS)}, or bundle for all of them."
        )
    return writers[name]
