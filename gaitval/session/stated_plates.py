"""What the user says of the force plates of a trial: which do not count, whose foot is on which,
and of which an axis points the wrong way.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaitval.coordinates import Side, opposite
from gaitval.errors import RecordError
from gaitval.mocap.axes import LETTERS
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.request import Request


def apply_options(recording: Recording, request: Request) -> Recording:
    """A `recording` with its plates as `request` says. Raises RecordError if one is not there."""
    found = without_plates(recording, request.no_plate)
    return with_stated_plates(found, request.plate, request.plate_axis)


def without_plates(recording: Recording, names: Sequence[str]) -> Recording:
    """A `recording` without the force plates `names`. Raises RecordError if one is not there."""
    known = [plate.name for plate in recording.plates]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise RecordError(
            f"{recording.source}: --no-plate {' '.join(unknown)}: there is no such plate; the "
            f"trial has {', '.join(known) or 'none'}."
        )
    kept = tuple(plate for plate in recording.plates if plate.name not in names)
    return replace(recording, plates=kept)


def with_stated_plates(
    recording: Recording, feet: Sequence[tuple[str, Side]], turned: Sequence[tuple[str, str]]
) -> Recording:
    """A `recording` whose plates have the feet that the user says (`--plate 2=right`), and no force
    along an axis of the file turned the wrong way (`turned`, `--plate-axis 2=y`; `_turned`). Raises
    RecordError if a plate is not there.
    """
    plates = {plate.name: plate for plate in recording.plates}
    for name, side in feet:
        if (name, opposite(side)) in feet:
            raise RecordError(
                f"--plate {name}=right and --plate {name}=left: a plate is said to be of one foot. "
                "Give one of them, or neither if both feet step on it."
            )
    for option, name in (
        *(("--plate", n) for n, _ in feet),
        *(("--plate-axis", n) for n, _ in turned),
    ):
        if name not in plates:
            raise RecordError(
                f"{recording.source}: {option} {name}=...: there is no such plate; the trial has "
                f"{', '.join(plates) or 'none'}."
            )
    for name, side in feet:
        plates[name] = replace(plates[name], foot=side)
    for name, axis in dict.fromkeys(turned):  # said twice it is turned once
        plates[name] = reversed_along(plates[name], [*LETTERS].index(axis))
    return replace(recording, plates=tuple(plates.values()))


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
