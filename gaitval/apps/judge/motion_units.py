"""Whether the numbers of a motion are in the units that its header gives: the joints of the legs
show it of angles, the root of lengths.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.scaling.opensim.placing import Motion
from gaitval.units import JOINT_SWING, PLACE, unit_of

LEGS: Final = ("hip_flexion", "knee_angle", "ankle_angle")


def without_turns(known: Skeleton, motion: Motion) -> tuple[Motion, list[str]]:
    """The `motion` without whole turns of the legs' joints, and a sentence on each."""
    values, found = dict(motion.values), []
    for name, angles in _of_legs(known, motion).items():
        # A leg's joint is within half a turn of straight, whatever its branch.
        turns = np.round(angles / JOINT_SWING.high)
        off = np.flatnonzero(turns)
        within = angles - JOINT_SWING.high * turns
        if len(off) and np.ptp(within) < np.pi:
            values[name] = within
            found.append(
                f"Motion: {name} is {np.degrees(angles[off[0]]):.0f}° at {motion.time[off[0]]:g} s "
                f"and, in {len(off)} frames, a whole turn (360°) or more off, which was undone."
            )
    return replace(motion, values=values), found


def check_units(known: Skeleton, motion: Motion, in_degrees: bool, source: str) -> None:
    """Raise RecordError if the translations of the root in `motion`, read from `source`, cannot be
    metres, or its angles not of the unit that the header gives, `in_degrees` or radians.
    """
    root = known.model.root()
    held = [
        (PLACE, "metres", float(np.median(np.abs(motion.values[name]))), name)
        for name in (root.coordinates if root else ())
        if name in motion.given and known.model.coordinates[name].motion == "translational"
    ]
    header, factor = ("degrees", np.degrees(1.0)) if in_degrees else ("radians", 1.0)
    swings = {factor * float(np.ptp(each)): name for name, each in _of_legs(known, motion).items()}
    held += [(JOINT_SWING, header, most, swings[most]) for most in sorted(swings)[-1:]]
    for quantity, unit, size, name in held:
        seen = unit_of(quantity, unit, size=size)
        # Who stands still in any unit is no walker, which is said elsewhere.
        if seen.unit is None and (seen.candidates or size > JOINT_SWING.high):
            raise RecordError(
                f"{source}: {name} goes up to {size:.4g} {unit}, as the file has it: "
                f"{seen.sentence}. OpenSim has lengths in metres; write inDegrees=yes into the "
                "header of degrees, inDegrees=no into that of radians, or export it again."
            )


def _of_legs(known: Skeleton, motion: Motion) -> Mapping[str, Array]:
    """Angles of the legs' joints by the model's name of the coordinate."""
    names = [name for ours, name in known.coordinates.items() if ours[:-2] in LEGS]
    return {name: motion.values[name] for name in names if name in motion.given}
