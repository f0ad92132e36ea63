"""The slope of the ground that a recording was made on, from the direction of gravity.

Over whole cycles of steady walking momentum does not change, so the mean force of the ground is
against gravity, wherever the axes of the file point. Where the belt is tilted and the axes with it,
as on a treadmill that is calibrated as it lies, the mean force leans forward uphill.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval.errors import RecordError
from gaitval.model.ground import LEVEL, Ground
from gaitval.session.average import total_forces
from gaitval.session.request import Notify, Request
from gaitval.session.trial import WalkingTrial

SAME: Final = 1.0
"""Degrees: a slope below it is called level, and one that is said may be as far from what the
forces show. The level treadmill and floor of two public recordings show 0.3 and -0.2 (WBDS01 and
Rajagopal's)."""


class FoundIncline(NamedTuple):
    """What the forces show.

    Attributes
    ----------
    slope : %, uphill positive.
    cycles : whole cycles of both feet that it is the mean of.
    """

    slope: float
    cycles: int

    @property
    def degrees(self) -> float:
        """The slope as an angle."""
        return _degrees(self.slope)


def found_incline(walks: Sequence[WalkingTrial], mass: float) -> FoundIncline | None:
    """The slope by the mean force of whole cycles of `walks` of a person of `mass` kg, less what
    changed the speed of the pelvis meanwhile; None if the plates show no cycle whole.
    """
    means = []
    for walk, cycle, total in total_forces(walks):
        speed = np.gradient(walk.positions[:, 3:6], walk.recording.time, axis=0)
        ends = [
            [np.interp(at, walk.recording.time, part) for part in speed.T]
            for at in (cycle.start, cycle.end)
        ]
        means.append(total.mean(axis=0) - mass * np.subtract(ends[1], ends[0]) / cycle.duration)
    if not means:
        return None
    forward, _, up = np.mean(means, axis=0)
    return FoundIncline(float(100.0 * forward / up), len(means))


def ground_of(request: Request, walks: Sequence[WalkingTrial], notify: Notify) -> Ground:
    """The ground of an import: as `request` says, else as the forces of its `walks` show, level
    where they show none. Raises RecordError where both are known and contradict each other.
    """
    found, said = found_incline(walks, request.mass_kg), request.incline
    if said is None:
        if found is None or abs(found.degrees) <= SAME or request.aid is not None:
            return LEVEL
        notify(
            "incline",
            f"the ground has a slope of {found.slope:+.1f} % ({found.degrees:+.1f} degrees): over "
            f"{found.cycles} whole cycles the mean force leans so much from the file's vertical. "
            "Say incline = 0 in a session file if it was level: the forces are then refused",
        )
        return Ground(found.slope)
    angle = _degrees(said)
    if found is not None and request.aid is None and abs(found.degrees - angle) > SAME:
        raise RecordError(
            f"incline = {said:g}: a slope of {angle:+.1f} degrees is said, but over {found.cycles} "
            f"whole cycles the mean force of the plates shows {found.degrees:+.1f} degrees. In "
            "steady walking it is against gravity, so both cannot be right within "
            f"{SAME:g} degree. Leave incline out to take {found.slope:+.1f} %, or, if the belt "
            "was tilted and the axes of the file are the room's, export markers and forces in the "
            "belt's axes; if the forces are turned or have a drift, --kinematics-only."
        )
    return Ground(said)


def _degrees(slope: float) -> float:
    """The angle of a `slope` in %."""
    return float(np.rad2deg(np.arctan(slope / 100.0)))
