"""Force plates from centres of pressure, which files may have instead of moments, or wrenches."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import (
    LONGEST_LEVER_M,
    UNLOADED_N,
    certain_load,
    make_plate,
    plate_axes,
)
from gaitval.mocap.recording import Plate
from gaitval.mocap.repairs import passed_over

LIMITS: Final[Mapping[str, float]] = {
    # m times the force, of the level parts of a torque about the centre of pressure.
    "largest_level_m": 0.005,
    # Programs write no centre of pressure below a vertical force of their own, of 20 to 50
    # N, and a force that is low-passed later is larger there.
    "faint_n": 100.0,
    # m. What an unloaded plate shows may also be a place, where those measured are this
    # near.
    "astray_m": 0.02,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


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
    RecordError : a force is missing, point or torque from `LIMITS` on; no foot exerts the torque.
    """
    size = np.linalg.norm(force, axis=1)
    loaded, point = size >= UNLOADED_N, measured_points(path, name, force, point)
    torque = np.where(np.isnan(torque) & (size < LIMITS["faint_n"])[:, None], 0.0, torque)
    gap = ~np.isfinite(size) | (loaded & ~np.isfinite(point + torque).all(axis=1))
    if gap.any():
        raise RecordError(
            f"{path}: plate {name}: the force, or where and about what it acts under load, is "
            f"missing in {np.count_nonzero(gap)} samples, the first of them {np.argmax(gap) + 1}. "
            "Export the forces without gaps."
        )
    torque = _about_pressure(path, name, force, point, torque)
    return Plate(
        name=name,
        corners=np.full((4, 3), np.nan),
        force=force,
        centre_of_pressure=np.where(loaded[:, None], point, np.nan),
        free_moment=np.where(loaded[:, None], torque, 0.0),
    )


def measured_points(path: Path, name: str, force: Array, point: Array) -> Array:
    """Centres of pressure (T, 3) m from `point` of plate `name` in the file `path`: the nearest in
    time where a program wrote none: NaN, or what it writes without a load, 0 or another constant.
    Under a `force` (T, 3) N from `LIMITS` on they stay as they are.
    """
    size, there = np.linalg.norm(force, axis=1), np.isfinite(point).all(axis=1)
    loaded = size >= UNLOADED_N
    idle = np.unique(point[there & ~loaded], axis=0)
    shown = (np.zeros(3), *idle) if len(idle) == 1 else (np.zeros(3),)
    rest = np.any([(point == each).all(axis=1) for each in shown], axis=0)
    known = np.flatnonzero(loaded & there & ~rest)
    if not len(known):
        return point
    order = np.interp(np.arange(len(point)), known, np.arange(len(known)))
    nearest = point[known[np.rint(order).astype(int)]]
    faint = loaded & (size < LIMITS["faint_n"])
    lost = faint & (
        ~there | (rest & (np.linalg.norm(point - nearest, axis=1) > LIMITS["astray_m"]))
    )
    if lost.any():
        passed_over(
            f"{path}: plate {name}: {np.count_nonzero(lost)} samples under up to "
            f"{size[lost].max():.0f} N have no centre of pressure; the nearest in time is used"
        )
    return np.where(lost[:, None], nearest, point)


def _about_pressure(path: Path, name: str, force: Array, point: Array, torque: Array) -> Array:
    """The torque (T, 3) Nm about the centre of pressure, which a foot can exert; one about another
    point of the plate is moved there. Refuses what is about no point.
    """
    strong = certain_load(np.linalg.norm(force, axis=1))
    lever = _lever(force, torque, strong)
    up = int(np.argmax(np.abs(force[strong]).sum(axis=0)))
    level = np.arange(3) != up
    across = _lever(force, torque * level, strong)
    # About the middle of a plate the torque is no larger, if the foot is near it, but not vertical.
    if lever <= LONGEST_LEVER_M and across <= LIMITS["largest_level_m"]:
        return torque
    # Of a moment about o, M = (p - o) × F + (0, 0, Tz), only the vertical part is of the foot; the
    # level ones say where o is: o × F = p × F - M.
    needed = np.cross(point, force) - torque
    crossed = np.stack([np.cross(unit, force) for unit in np.eye(3)], axis=2)
    rows, wanted = crossed[strong][:, level].reshape(-1, 3), needed[strong][:, level].reshape(-1)
    about = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    free = torque - np.cross(point - about, force)
    upright = np.where(level, 0.0, free)
    # About the right point only the vertical torque is left, and a foot can exert it.
    if (
        _lever(force, free - upright, strong) <= LIMITS["largest_level_m"]
        and _lever(force, upright, strong) <= LONGEST_LEVER_M
    ):
        passed_over(
            f"{path}: plate {name}: the torque is about {np.round(about, 3).tolist()} m and not "
            "about the centre of pressure; the free moment is computed from it"
        )
        return upright
    if lever <= LONGEST_LEVER_M:  # about no one point: noise, or a filter
        size = f"{across:.3g} m times the force across the vertical (median)"
        message = f"{path}: plate {name}: no foot exerts its torque of {size}; it is used as it is"
        passed_over(message)
        return torque
    raise RecordError(
        f"{path}: plate {name}: the torque is {lever:.3g} m times the force under load (median), "
        f"but a foot can twist on the ground with at most {LONGEST_LEVER_M:g} m times the force, "
        "about the vertical alone. It is in Nmm (divide by 1000), or the moment about the plate's "
        "middle or origin: export the free moment about the centre of pressure."
    )


def _lever(force: Array, torque: Array, strong: Flags) -> float:
    """Median of torque over force, m, where the force is a person's; 0 where none is."""
    if not strong.any():
        return 0.0
    sizes = [np.linalg.norm(each[strong], axis=1) for each in (torque, force)]
    return float(np.median(sizes[0] / sizes[1]))


def plate_under(
    name: str, corners: Array, force: Array, moment: Array, *, moved: Array | float = 0.0
) -> Plate:
    """A plate from a wrench in the axes of its corners.

    Parameters
    ----------
    name : of the plate.
    corners : (4, 3) m, in the order of the quadrants.
    force, moment : (T, 3) N and Nm, on the person, the moment about the origin.
    moved : (T, 3) m from the origin of the moment to that of the corners, if they are two.
    """
    axes, middle = plate_axes(corners), corners.mean(axis=0)
    # From the origin O to the middle P of the surface: M_P = M_O - (P - O) x F.
    about_middle = moment - np.cross(moved + middle, force)
    return make_plate(name, corners, force @ axes, about_middle @ axes)
