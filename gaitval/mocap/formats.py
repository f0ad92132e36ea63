"""Markers and forces of other formats than C3D, by the ending of the file."""

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval import plugins
from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.recording import DeviceTorque, Plate, Recording
from gaitval.mocap.separate_forces import during, with_plates


def _trc(path: Path) -> Recording:
    from gaitval.mocap.trc import read_trc

    return read_trc(path)


def _csv(path: Path) -> Recording:
    from gaitval.mocap.vicon_csv import read_vicon_csv

    return read_vicon_csv(path)


def _tsv(path: Path) -> Recording:
    from gaitval.mocap.qualisys_tsv import read_qualisys_tsv

    return read_qualisys_tsv(path)


def _txt(path: Path) -> Recording:
    from gaitval.mocap.wbds_text import read_wbds_markers

    return read_wbds_markers(path)


READERS: Final[dict[str, Callable[[Path], Recording]]] = {
    ".trc": _trc,
    ".csv": _csv,
    ".tsv": _tsv,
    ".txt": _txt,
}
"""Each loads what it needs when a file of its kind is read."""


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


_PlateForces = tuple[float, float, tuple[Plate, ...]]
"""Rate, Hz, the first time, s, and the plates."""


def _mot(path: Path, recording: Recording) -> _PlateForces:
    from gaitval.mocap.mot import read_ground_reaction

    del recording
    return read_ground_reaction(path)


def _motion_analysis(path: Path, recording: Recording) -> _PlateForces:
    from gaitval.mocap.motion_analysis import read_motion_analysis_forces

    return read_motion_analysis_forces(path, recording)


def _tsv_forces(path: Path, recording: Recording) -> _PlateForces:
    from gaitval.mocap.qualisys_tsv import read_qualisys_forces

    return read_qualisys_forces(path, recording)


def _txt_forces(path: Path, recording: Recording) -> _PlateForces:
    from gaitval.mocap.kistler_text import read_kistler_text

    return read_kistler_text(path, recording)


FORCE_READERS: Final[dict[str, Callable[[Path, Recording], _PlateForces]]] = {
    ".mot": _mot,
    ".sto": _mot,
    ".forces": _motion_analysis,
    ".tsv": _tsv_forces,
    ".txt": _txt_forces,
}
"""Each loads what it needs when a file of its kind is read."""


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
    rate, start, plates = reader(path, recording)
    if part is not None:
        recording = recording.between(part, "--trial-time")
        plates, start = during(plates, rate, start, recording)
    found = with_plates(recording, path, plates, rate=rate, start=start)
    return _with_devices(found, path) if reader is _mot else found


def _with_devices(recording: Recording, path: Path) -> Recording:
    """The recording with the torques of devices in the file of its forces, at its own times."""
    from gaitval.mocap.mot import read_device_torques

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
