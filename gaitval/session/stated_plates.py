"""What the user says of the force plates of a trial: which do not count, whose foot is on which,
and of which an axis points the wrong way.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaitval.coordinates import SIDES, opposite
from gaitval.errors import RecordError
from gaitval.mocap.axes import LETTERS
from gaitval.mocap.recording import Plate, Recording


def with_stated_plates(recording: Recording, stated: Sequence[tuple[str, str]]) -> Recording:
    """A `recording` with its plates as `stated`, a list of names and `request.PlateUse`: with the
    feet that are on them, without those that do not count, and no force along an axis of the file
    turned the wrong way.

    Raises RecordError if a plate is not there, or is said to be of either foot alone.
    """
    plates = {plate.name: plate for plate in recording.plates}
    for name, use in stated:
        if name not in plates:
            raise RecordError(
                f"{recording.source}: --plate {name}={use}: there is no such plate; the trial has "
                f"{', '.join(plates) or 'none'}."
            )
        if use in SIDES and (name, opposite(use)) in stated:
            raise RecordError(
                f"--plate {name}=right and --plate {name}=left: a plate is said to be of one foot. "
                "Give one of them, or neither if both feet step on it."
            )
    for name, use in dict.fromkeys(stated):  # said twice it is turned once
        if use in SIDES:
            plates[name] = replace(plates[name], foot=use)
        elif use in LETTERS:
            plates[name] = reversed_along(plates[name], [*LETTERS].index(use))
    kept = [plate for name, plate in plates.items() if (name, "none") not in stated]
    return replace(recording, plates=tuple(kept))


def reversed_along(plate: Plate, axis: int) -> Plate:
    """A `plate` whose force along an `axis` (0, 1, 2) is reversed; the centre of pressure stays.

    The free moment is what the forces leave of the moment about the vertical through the plate's
    centre. That may have been reversed as well, as in a plate that was set up as its mirror image,
    or not, as with a channel of the wrong sign: the smaller free moment decides. Where the file
    gives no corners, the free moment is reversed.
    """
    force = plate.force * np.where(np.arange(3) == axis, -1.0, 1.0)
    arm = plate.centre_of_pressure - plate.corners.mean(axis=0)
    up = int(np.argmax(np.abs(plate.free_moment).sum(axis=0)))
    free = [-plate.free_moment]
    if np.isfinite(plate.corners).all():
        whole = (plate.free_moment + np.cross(arm, plate.force))[:, up]
        given = np.isfinite(arm).all(axis=1)
        rest = np.where(given, np.cross(arm, force)[:, up], 0.0)
        along = np.where(given, np.array([[-1.0], [1.0]]) * whole - rest, 0.0)
        free = [each[:, None] * np.eye(3)[up] for each in along]
    least = min(free, key=lambda each: float(np.square(each).sum()))
    return replace(plate, force=force, free_moment=least, moment=None)
