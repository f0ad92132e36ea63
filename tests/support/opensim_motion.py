"""Read motion as OpenSim writes it for the model that `osim.write_osim` writes."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.mot import read_storage
from gaitval.session.opensim.coordinates import OPENSIM_COORDINATES, PELVIS_TRANSLATIONS, TO_OPENSIM

_ROTATIONS = np.array([name not in PELVIS_TRANSLATIONS for name in OPENSIM_COORDINATES])


def read_motion(path: Path) -> tuple[Array, Array]:
    """Read a motion of the exported model from `path`, as OpenSim's inverse kinematics writes it:
    time (T,) s and positions (T, 31) as `write_motion` takes them.

    Raises RecordError if it is not a storage file, or it lacks coordinates of the model and so is
    for another model.
    """
    table = read_storage(path)
    missing = [name for name in OPENSIM_COORDINATES if name not in table.columns]
    if missing:
        raise RecordError(
            f"{path}: not a motion of a model that gaitval wrote: the coordinates "
            f"{', '.join(missing)} are missing. Run OpenSim's inverse kinematics with the .osim "
            "file of this subject."
        )
    values = np.column_stack([table.column(name) for name in OPENSIM_COORDINATES])
    if table.in_degrees:
        values[:, _ROTATIONS] = np.deg2rad(values[:, _ROTATIONS])
    return table.time, from_opensim(values)


def from_opensim(values: Array) -> Array:
    """The inverse of `to_opensim`: `values` (T, 31) in the order of `OPENSIM_COORDINATES` to
    positions.

    The rotation vector is the shortest (at most half a turn).
    """
    positions = np.array(values, dtype=float)
    pelvis = Rotation.from_euler("ZXY", positions[:, :3]).as_matrix()
    positions[:, :3] = Rotation.from_matrix(TO_OPENSIM.T @ pelvis @ TO_OPENSIM).as_rotvec()
    positions[:, 3:6] = positions[:, 3:6] @ TO_OPENSIM
    return positions
