"""Markers and forces of other formats than C3D, by the ending of the file."""

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval import plugins
from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.kistler_text import read_kistler_text
from gaitval.mocap.mot import read_device_torques, read_ground_reaction
from gaitval.mocap.motion_analysis import read_motion_analysis_forces
from gaitval.mocap.qualisys_tsv import read_qualisys_forces, read_qualisys_tsv
from gaitval.mocap.recording import DeviceTorque, Recording
from gaitval.mocap.separate_forces import during, with_plates
from gaitval.mocap.trc import read_trc
from gaitval.mocap.vicon_csv import read_vicon_csv
from gaitval.mocap.wbds_text import read_wbds_markers

READERS: Final[Mapping[str, Callable[[Path], Recording]]] = {
    ".trc": read_trc,
    ".csv": read_vicon_csv,
    ".tsv": read_qualisys_tsv,
    ".txt": read_wbds_markers,
}
"""Reader by the ending of a file."""


def read_other(path: Path) -> Recording:
    """The markers in a file that is not C3D, as its reader gives them. Raises RecordError, as that
    does, and if there is none for the ending of `path`.
    """
    kind = path.suffix.lower()
    reader = READERS.get(kind) or plugins.of_ending(plugins.RECORDINGS, path)
    if reader is not None:
        found: Recording = reader(path)
        return found
    if path.is_dir():
        raise RecordError(
            f"{path}: is a folder. Give the file of a trial in it; `gaitval import` takes folders."
        )
    raise RecordError(
        f"{path}: markers are read from .c3d{further(READERS, plugins.RECORDINGS)} and WBDS's "
        f"mkr.txt files, not from {kind or 'a file without an ending'}. Export the trial as "
        "C3D."
    )


def further(readers: Iterable[str], group: str) -> str:
    """The endings of our own `readers` and of other distributions' in a `group`, for a message."""
    endings = [*readers, *(f".{name}" for name in plugins.names(group))]
    return "".join(f", {each}" for each in endings if each != ".txt")


FORCE_READERS: Final[Mapping[str, Callable[..., Any]]] = {
    ".mot": read_ground_reaction,
    ".sto": read_ground_reaction,
    ".forces": read_motion_analysis_forces,
    ".tsv": read_qualisys_forces,
    ".txt": read_kistler_text,
}
"""Likewise; each gives the rate, Hz, the first time, s, and the plates."""


def with_forces(
    recording: Recording, path: Path, part: tuple[float, float] | None = None
) -> Recording:
    """The `recording` with the plates of the force file `path`, cut to the time that both cover, or
    to a `part` (s) that both cover. Raises RecordError as its reader and `with_plates` do, for
    another kind of file, and if the recording has plates itself.
    """
    kind = path.suffix.lower()
    reader = FORCE_READERS.get(kind) or plugins.of_ending(plugins.FORCES, path)
    if reader is None:
        endings = further(FORCE_READERS, plugins.FORCES).removeprefix(", ")
        raise RecordError(
            f"{path}: forces are read from {endings} and WBDS's grf.txt "
            f"files, not from {path.suffix or 'a file without an ending'}. If a C3D file has "
            "them with the markers, give it as the trial, without --forces."
        )
    if recording.plates:
        raise RecordError(
            f"{recording.source} has {len(recording.plates)} force plates, and {path} was given "
            "too, so it is unclear which to use. Leave one out."
        )
    of_opensim = kind in (".mot", ".sto")  # in the markers' axes and units, so it needs no markers
    rate, start, plates = reader(path) if of_opensim else reader(path, recording)
    if part is not None:
        recording = recording.between(part, "--trial-time")
        plates, start = during(plates, rate, start, recording)
    found = with_plates(recording, path, plates, rate=rate, start=start)
    return _with_devices(found, path) if of_opensim else found


def _with_devices(recording: Recording, path: Path) -> Recording:
    """The recording with the torques of devices in the file of its forces, at its own times."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)  # said when the plates were read
        time, torques = read_device_torques(path)
    return replace(
        recording,
        devices=tuple(
            DeviceTorque(
                name,
                np.column_stack(
                    [np.interp(recording.time, time, each, np.nan, np.nan) for each in torque.T]
                ),
            )
            for name, torque in torques.items()
        ),
    )
