"""Whether the numbers of a motion can be angles in the unit that its header gives, and metres.

A header may be wrong: a motion in radians called degrees hardly moves, one in degrees called
radians turns its joints several times round. The joints of the legs show it, for nobody's knee
turns right round, and in no walk does it move by a degree only.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.coordinates import RANGES
from gaitval.errors import RecordError
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import Motion
from gaitval.units import JOINT_SWING

LEGS: Final = ("hip_flexion", "knee_angle", "ankle_angle")


def check_unit(known: Skeleton, motion: Motion, in_degrees: bool, source: str) -> list[str]:
    """Raise RecordError, with what the numbers show, if those of `motion` (rad, as read from
    `source` with its unit `in_degrees`) cannot be of that unit. Returns sentences about single
    joints that seem to be of another unit than the others.
    """
    angles = _of_legs(known, motion)
    if not angles:
        return []
    header = "degrees" if in_degrees else "radians"
    most = max(angles, key=lambda name: float(np.abs(angles[name]).max()))
    largest = float(np.abs(angles[most]).max())
    if largest > JOINT_SWING.high:
        why = (
            "they look like degrees: write inDegrees=yes into the header"
            if not in_degrees
            else "they look like degrees that were converted into degrees once more, are speeds or "
            "accelerations (…_u.sto, …_dudt.sto), or inverse kinematics lost the leg: look at the "
            "motion, and export it again"
        )
        raise RecordError(
            f"{source}: {most} is up to {np.degrees(largest):.0f}° in the unit that the header "
            f"gives ({header}), but no joint of a leg turns right round. The numbers go up to "
            f"{_number(largest, in_degrees):.4g}; {why}."
        )
    _check_knees(known, motion, source)
    if not in_degrees:
        return []
    ranges = _ranges(known)
    moved = {name: float(np.ptp(values)) for name, values in angles.items()}
    other = [name for name in angles if _fits_as_radians(angles[name], ranges.get(name))]
    most = max(moved, key=lambda name: moved[name])
    if moved[most] < JOINT_SWING.low and len(other) == len(angles):
        raise RecordError(
            f"{source}: no joint of the legs moves by more than {np.degrees(moved[most]):.2g}° "
            f"({most}) in the unit that the header gives (degrees), but in radians it would move "
            f"by {np.degrees(np.degrees(moved[most])):.0f}°: the numbers look like radians. If "
            "they are, write inDegrees=no into the header; if the person stood still, there is no "
            "walk to judge."
        )
    return [
        f"Unit: {name} moves by {np.degrees(moved[name]):.2g}°, and {most} by "
        f"{np.degrees(moved[most]):.0f}°: its column looks like radians, where the header says "
        "degrees. Export the motion again, unless this joint is stiff."
        for name in other
        if moved[name] < JOINT_SWING.low and moved[most] > LIMITS.joint_moves
    ]


def sound_part(known: Skeleton, motion: Motion) -> tuple[Motion, list[str]]:
    """The `motion` without whole turns and without frames in which inverse kinematics lost a leg,
    and a sentence on each.
    """
    values, found = dict(motion.values), []
    for name, angles in _of_legs(known, motion).items():
        # A leg's joint is within half a turn of straight, whatever its branch.
        turns = np.round(angles / JOINT_SWING.high)
        off = np.flatnonzero(turns)
        if len(off) and np.ptp(angles - JOINT_SWING.high * turns) < np.pi:
            values[name] = angles - JOINT_SWING.high * turns
            found.append(
                f"Motion: {name} is {np.degrees(angles[off[0]]):.0f}° at {motion.time[off[0]]:g} s "
                f"and, in {len(off)} frames, a whole turn (360°) or more off, which was undone."
            )
    lost = np.zeros(len(motion.time), dtype=bool)
    for name in _of_legs(known, motion):
        lost |= np.abs(values[name]) > np.pi
    edges = np.flatnonzero(np.diff(np.concatenate(([True], lost, [True])).astype(int)))
    runs = list(zip(edges[::2], edges[1::2], strict=True))
    if not lost.any() or not runs:
        return replace(motion, values=values), found
    first, last = max(runs, key=lambda run: run[1] - run[0])
    if last - first < len(lost) // 4:
        return motion, []
    at = motion.time
    found.append(
        f"Motion: {int(lost.sum())} of {len(lost)} frames have a leg's joint beyond half a turn: "
        f"inverse kinematics lost the leg. Judged is {at[first]:g} to {at[last - 1]:g} s."
    )
    kept = {name: each[first:last] for name, each in values.items()}
    return replace(motion, time=at[first:last], values=kept), found


def check_lengths(model: OsimModel, motion: Motion, source: str) -> None:
    """Raise RecordError if the translations of the root in a `motion`, read from `source`, cannot
    be metres.
    """
    root = model.root()
    moved = {
        name: float(np.median(np.abs(motion.values[name])))
        for name in (root.coordinates if root else ())
        if name in motion.given and model.coordinates[name].motion == "translational"
    }
    most = max(moved, key=lambda name: moved[name], default=None)
    if most is not None and moved[most] > LIMITS.farthest_root:
        unit = "millimetres" if moved[most] > 10 * LIMITS.farthest_root else "centimetres"
        raise RecordError(
            f"{source}: {most} is {moved[most]:.0f} m in the median, and no laboratory is so long; "
            f"translations look like {unit}. OpenSim has them in metres: export the motion "
            "again, or divide these columns."
        )


def _check_knees(known: Skeleton, motion: Motion, source: str) -> None:
    """Refuse a motion whose knees bend forward as far as knees bend backward in walking: it is of a
    model with the other sign.
    """
    wrong = {}
    for ours in ("knee_angle_r", "knee_angle_l"):
        name, sense = known.coordinates.get(ours, ""), known.senses.get(ours, 0)
        if not sense or name not in motion.given:
            continue
        flexion = sense * motion.values[name]
        if (
            flexion.min() < RANGES[ours][0] - 2 * LIMITS.beyond_range
            and flexion.max() < LIMITS.beyond_range
        ):
            wrong[name] = float(np.degrees(motion.values[name][np.argmin(flexion)]))
    if wrong:
        raise RecordError(
            f"{source}: in this model {' and '.join(wrong)} of {min(wrong.values(), key=abs):.0f}° "
            "are knees that bend forward, and they never bend backward: the motion is of a model "
            "with the other sign (of Gait2354 and Gait2392 flexion is negative, of Rajagopal's "
            "positive). Give the model that inverse kinematics was run with."
        )


def _of_legs(known: Skeleton, motion: Motion) -> Mapping[str, Array]:
    """Angles by the model's name of the coordinate: of the legs' joints, or of all joints of a
    model whose legs have other names.
    """
    names = {
        name
        for ours, name in known.coordinates.items()
        if ours[:-2] in LEGS and name in motion.given
    }
    if not names:
        root = known.model.root()
        of_root = root.coordinates if root else ()
        names = {
            name
            for name, each in known.model.coordinates.items()
            if name in motion.given and each.motion == "rotational" and name not in of_root
        }
    return {name: motion.values[name] for name in motion.values if name in names}


def _ranges(known: Skeleton) -> Mapping[str, tuple[float, float]]:
    """Lowest and highest angle, rad, by the model's name, where its sense is known."""
    found = {}
    for ours, name in known.coordinates.items():
        low, high = RANGES[ours]
        if sense := known.senses.get(ours, 0):
            found[name] = (low, high) if sense > 0 else (-high, -low)
    return found


def _fits_as_radians(values: Array, allowed: tuple[float, float] | None) -> bool:
    """Whether the numbers of `values` (rad, read from degrees), taken as radians, are angles of a
    joint that moves.
    """
    numbers = np.degrees(values)
    low, high = allowed or (-np.pi, np.pi)
    inside = (
        low - LIMITS.beyond_range <= numbers.min() and numbers.max() <= high + LIMITS.beyond_range
    )
    return bool(inside and np.ptp(numbers) > LIMITS.joint_moves)


def _number(angle: float, in_degrees: bool) -> float:
    return float(np.degrees(angle)) if in_degrees else angle
