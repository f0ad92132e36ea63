"""Wrench, centre of pressure and free moment of force plates, as the C3D format describes them.

Types 1 to 4 of https://www.c3d.org/HTML/Documents/forceplatformtype.htm; types 5 to 7, which
c3d.org does not describe, as Visual3D has them
(https://wiki.has-motion.com/doku.php?id=visual3d:documentation:pipeline:force_commands:fp_type).
A plate's own axes come from its corners, which are numbered by the quadrants of its surface:
1 (+x, +y), 2 (-x, +y), 3 (-x, -y), 4 (+x, -y). With the usual numbering its z points down.
"""

from collections.abc import Callable
from typing import Final, TypeVar

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import RecordError
from gaitval.mocap.recording import Plate

_Made = TypeVar("_Made", bound=Plate | None)

CHANNELS: Final[dict[int, int]] = {1: 6, 2: 6, 3: 8, 4: 6, 5: 8, 6: 12, 7: 8}
"""Number of analog channels of each supported plate type."""

CALIBRATIONS: Final[dict[int, tuple[int, int]]] = {4: (6, 6), 5: (6, 8), 6: (12, 12), 7: (8, 8)}
"""Rows (what it gives) and columns (channels) of the calibration matrix, of the types with one."""

UNLOADED_N: Final = 10.0
"""Force below which a plate has no centre of pressure, N: half the 20 N at which a foot counts as
on the ground, so that everything used later is kept. At this force a plate's noise of 1 N moves the
centre of pressure by a tenth of its lever arm; at smaller forces by ever more."""

LONGEST_LEVER_M: Final = 0.1
"""The torque about the centre of pressure is at most this times the force, m: friction keeps it
below half a foot's length. The medians are 0.004 (Rajagopal et al. 2016) and 0.036 (WBDS01 T01,
whose plates are not zeroed)."""

CERTAIN_LOAD_N: Final = 200.0
"""A force above this is a person's, not an offset or noise, N."""

LIGHTEST_LOAD_N: Final = 80.0
"""Who weighs 10 kg, the lightest person that is taken, loads a plate with more than this, N."""


def certain_load(size: Array) -> Flags:
    """Where a force is a person's, by its `size` (T,), N: above `CERTAIN_LOAD_N`, to which a child
    of less than 18 kg never comes, or in the upper half of what a plate with smaller forces shows.
    That half begins at least `LIGHTEST_LOAD_N` above the least, which an offset does not exceed.
    """
    least = float(np.nanmin(size, initial=CERTAIN_LOAD_N))
    most = float(np.nanmax(size, initial=0.0))
    upper = least + max(LIGHTEST_LOAD_N, (most - least) / 2)
    return np.asarray(size > min(CERTAIN_LOAD_N, upper))


def plate_or_fault(name: str, samples: int, make: Callable[[], _Made]) -> _Made | Plate:
    """The plate that `make` gives. Where that raises a RecordError, a plate of this `name` without
    forces in any of its `samples`, with the error as its fault: nobody may have stepped on it.
    """
    try:
        return make()
    except RecordError as error:
        gap, nothing = np.full((samples, 3), np.nan), np.zeros((samples, 3))
        return Plate(name, np.full((4, 3), np.nan), nothing, gap, nothing, fault=str(error))


def plate_axes(corners: Array) -> Array:
    """Axes of a plate as the columns of a rotation (plate to laboratory), shape (3, 3), from its
    `corners` (4, 3) in the order of the quadrants (see the module's docstring). Measured ones are
    not exactly in a plane and at right angles: x is along the mean of both edges, z perpendicular
    to both diagonals, and no corner counts more than another.
    """
    x = corners[0] - corners[1] + corners[3] - corners[2]
    z = np.cross(corners[3] - corners[1], corners[0] - corners[2])
    y = np.cross(z, x)
    return np.column_stack([axis / np.linalg.norm(axis) for axis in (x, y, z)])


def numbered_other_way(plate: Plate) -> bool:
    """Whether the corners of a `plate`, in axes whose z points up, are numbered the other way round
    than C3D has them: then it is mirrored.
    """
    return bool(np.isfinite(plate.corners).all() and plate_axes(plate.corners)[2, 2] > 0.0)


RENUMBER: Final = (
    "numbered the other way round than the format has them (1 to 4 clockwise, seen from above, "
    "from the corner at +x, +y of the plate, whose z points down), which mirrors the plate: "
    "number them in that order (C3D: FORCE_PLATFORM:CORNERS) and export again"
)
"""What is said of such corners."""


def plate_wrench(
    kind: int, channels: Array, origin: Array, calibration: Array | None = None
) -> tuple[Array, Array]:
    """Force and moment about the middle of the plate's surface, in the plate's axes.

    Parameters
    ----------
    kind : type 1 to 7.
    channels : (T, 6, 8 or 12) in the order of the type.
        1: Fx, Fy, Fz, centre of pressure x, y, free moment z.
        2 and 4: Fx, Fy, Fz, Mx, My, Mz about the sensors' origin, 4 before its calibration.
        3 and 7: Fx12, Fx34, Fy14, Fy23, Fz1, Fz2, Fz3, Fz4 of the four sensors (Kistler), 7
        before its calibration.
        5: eight sensors (Cz, Dz, Az, Bz, Yac, Xdc, Xab, Ybd), whose calibration gives the channels
        of type 2.
        6: Fx, Fy, Fz of each of four sensors, before their calibration.
    origin : (3,) m. 2, 4 and 5: from the sensors' origin to the middle of the surface, so that z is
        negative in a plate whose z points down. 3, 6 and 7: x and y are half the distances between
        the sensors, of either sign, and z is as before. 1: not used.
    calibration : of types 4 to 7, see `CALIBRATIONS`; None if it was already applied.

    Returns
    -------
    tuple
        Force (T, 3) N and moment (T, 3) Nm, with the sign of the channels.
    """
    # Samples are rows, so C v becomes v Cᵀ.
    loads = channels if calibration is None else channels @ calibration.T
    if kind in (1, 3, 6, 7):
        from gaitval.mocap.plate_sensors import wrench_of_sensors

        return wrench_of_sensors(kind, loads, origin)
    return loads[:, :3], loads[:, 3:] + np.cross(loads[:, :3], origin)


def make_plate(name: str, corners: Array, force: Array, moment: Array) -> Plate:
    """A plate of this `name` in the laboratory's axes, with `corners` (4, 3) m in them in the order
    of the quadrants, from `force` and `moment` (T, 3) N and Nm of the plate on the person in the
    plate's axes, the moment about the middle of the surface; see `plate_under` for one in the
    laboratory's.

    In the plate's axes the centre of pressure p lies on the surface (z = 0) where the moment is
    vertical: M - p x F = (0, 0, Tz), hence px = -My / Fz, py = Mx / Fz (Winter 2009, chapter 5).
    """
    axes, centre = plate_axes(corners), corners.mean(axis=0)
    # The plate's z usually points down, where the force on the person is negative.
    loaded = np.abs(force[:, 2]) >= UNLOADED_N
    vertical = np.where(loaded, force[:, 2], np.nan)
    pressure = np.column_stack(
        [-moment[:, 1] / vertical, moment[:, 0] / vertical, np.where(loaded, 0.0, np.nan)]
    )
    free = np.zeros_like(moment)
    # The moment that remains about the centre of pressure; x and y vanish by its definition.
    free[loaded, 2] = (moment - np.cross(pressure, force))[loaded, 2]
    turned = force @ axes.T
    return Plate(
        name=name,
        corners=corners,
        force=turned,
        centre_of_pressure=pressure @ axes.T + centre,
        free_moment=free @ axes.T,
        # From the middle of the surface c to the origin: M + c × F.
        moment=moment @ axes.T + np.cross(centre, turned),
    )
