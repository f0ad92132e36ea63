"""Force plates whose channels are not force and moment about the sensors' origin: the centre of
pressure (type 1), each sensor's own forces (types 3, 6 and 7), or not calibrated (4 to 7).
"""

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.c3d_contents import Contents


def wrench_of_sensors(kind: int, loads: Array, origin: Array) -> tuple[Array, Array]:
    """`force_plates.plate_wrench` of a plate of a `kind` of 1, 3, 6 or 7: `loads` (T, 6, 8 or 12)
    are its channels after calibration; `origin` (3,) is in m.
    """
    if kind == 1:
        force = loads[:, :3]
        # About the middle of the surface: M = p × F + T, with p on the surface.
        at = np.column_stack([loads[:, 3:5], np.zeros(len(loads))])
        moment = np.cross(at, force)
        moment[:, 2] += loads[:, 5]
        return force, moment
    # Sensors 1 to 4 are in the quadrants of the corners, half_x and half_y from the middle.
    half_x, half_y = abs(origin[0]), abs(origin[1])
    up_to_surface = np.array([0.0, 0.0, origin[2]])
    if kind == 6:
        at = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) * [half_x, half_y, 0.0]
        each = loads.reshape(-1, 4, 3)
        force = each.sum(axis=1)
        return force, np.cross(at, each).sum(axis=1) + np.cross(force, up_to_surface)
    x12, x34, y14, y23, z1, z2, z3, z4 = loads.T
    force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    # Mx = Σ y Fz, My = −Σ x Fz, Mz = Σ (x Fy − y Fx).
    moment = np.column_stack(
        [
            half_y * (z1 + z2 - z3 - z4),
            half_x * (z2 + z3 - z1 - z4),
            half_y * (x34 - x12) + half_x * (y14 - y23),
        ]
    )
    # Moved by d the moment is M + F × d.
    return force, moment + np.cross(force, up_to_surface)


def stored_calibration(
    where: str, contents: Contents, kind: int, index: int, shape: tuple[int, int]
) -> Array:
    """The calibration matrix of a plate of type 4 to 7.

    A square matrix that is stored by rows (`MATRIX_STORE`), and an oblong one whose declared size
    has the channels first, is transposed.

    Parameters
    ----------
    where : the plate, for the message.
    contents : of the file.
    kind, index : type and number of the plate.
    shape : rows and columns, see `force_plates.CALIBRATIONS`.

    Raises
    ------
    RecordError : the file has none.
    """
    rows, columns = shape
    stored = contents.of_plate("CAL_MATRIX", index, rows, columns)
    if rows != columns and stored is None:
        turned = contents.of_plate("CAL_MATRIX", index, columns, rows)
        stored = None if turned is None else turned.T
    if stored is None or not np.any(stored):
        raise RecordError(
            f"{where} is of type {kind}, but FORCE_PLATFORM:CAL_MATRIX has no calibration of "
            f"{rows} by {columns} for it. Enter it in the recording program and export again."
        )
    by_row = contents.text("FORCE_PLATFORM", "MATRIX_STORE").upper() == "BYROW"
    return stored.T if by_row and rows == columns else stored
