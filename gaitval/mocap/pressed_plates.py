"""Force plates in files that have the centre of pressure instead of moments."""

from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import CERTAIN_LOAD_N, LONGEST_LEVER_M, UNLOADED_N
from gaitval.mocap.recording import Plate

LONGEST_PLATE_M: Final = 1.0
"""A moment about the middle or a corner of a plate is at most this times the force, m."""


def pressed_plate(path: Path, name: str, force: Array, point: Array, torque: Array) -> Plate:
    """A plate in a file that has the centre of pressure instead of moments; its corners are
    unknown.

    Parameters
    ----------
    path : the file, for messages.
    name : of the plate.
    force : (T, 3) N on the person.
    point : (T, 3) m, centre of pressure; read only where the plate is loaded (`UNLOADED_N`).
    torque : (T, 3) Nm on the person about `point`, likewise.

    Raises
    ------
    RecordError : a force is missing, or a point or torque under load; or the torque is more than a
        foot can exert.
    """
    if not np.isfinite(force).all():
        raise RecordError(
            f"{path}: plate {name}: {np.count_nonzero(~np.isfinite(force).all(axis=1))} force "
            "samples are missing. Export the forces without gaps."
        )
    loaded = np.linalg.norm(force, axis=1) >= UNLOADED_N
    if not (np.isfinite(point[loaded]).all() and np.isfinite(torque[loaded]).all()):
        raise RecordError(
            f"{path}: plate {name}: the centre of pressure or the torque is missing where the "
            "plate is loaded. Export the forces without gaps."
        )
    _check_torque(path, name, force, torque)
    return Plate(
        name=name,
        corners=np.full((4, 3), np.nan),
        force=force,
        centre_of_pressure=np.where(loaded[:, None], point, np.nan),
        free_moment=np.where(loaded[:, None], torque, 0.0),
    )


def _check_torque(path: Path, name: str, force: Array, torque: Array) -> None:
    """Refuse a torque about the centre of pressure that no foot can exert."""
    size = np.linalg.norm(force, axis=1)
    strong = size > CERTAIN_LOAD_N
    if not strong.any():
        return
    lever = float(np.median(np.linalg.norm(torque[strong], axis=1) / size[strong]))
    if lever <= LONGEST_LEVER_M:
        return
    why = (
        "It looks like Nmm: divide the torques by 1000"
        if lever > LONGEST_PLATE_M
        else "It looks like the moment about the plate's middle or origin: export the free moment "
        "about the centre of pressure"
    )
    raise RecordError(
        f"{path}: plate {name}: the torque is {lever:.3g} m times the force under load (median), "
        f"but a foot can twist on the ground with at most {LONGEST_LEVER_M:g} m times the force. "
        f"{why}."
    )
