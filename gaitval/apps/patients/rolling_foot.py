"""What the angles of a stride say of its length, of stance, and of the left heel strike.

A foot on the ground does not move, so under the pelvis it moves back as fast as the body goes
forward. The legs' lengths and the angles say by how much. From `ROLLING[0]` to `ROLLING[1]` of its
own cycle, half a stride, the ball of the foot is on the ground or just leaves it; the mean of both
sides does not depend on how the pelvis surges, which it does twice a stride.

`TRAVEL`, `STANCE_BIAS` and their errors are of the fourteen trials of the ten built-in people with
the body of leg length and stature; `claims/patients.py` of commit 60ee3cba tests the result on 32
others.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.patients.estimates import EstimatedValue
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.gait.record import RECORDED_ANGLES, PeriodicCurve
from gaitval.model.body import BodyModel
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import ROOT_DOFS, segment_frames, tree_arrays

POINTS: Final = 200
ROLLING: Final = (0.08, 0.58)
TRAVEL: Final = EstimatedValue(0.986, 0.026, "fourteen trials of the ten built-in people")
"""Travel of the ball of the foot in this half of the cycle / half a stride, mean and standard
deviation."""
TOE_OFF: Final = (0.5, 0.85)
"""Of the own cycle, within which the foot leaves the ground."""
STANCE_BIAS: Final = EstimatedValue(0.024, 0.015, "fourteen trials of the ten built-in people")
"""By how much later than the force ends the ball of the foot is furthest behind the pelvis (Zeni et
al. 2008, Gait Posture 27:710), of the cycle, mean and standard deviation."""


class RolledFeet(NamedTuple):
    """What is found of a stride.

    Attributes
    ----------
    stride_length : m.
    sd : m, its standard deviation for these legs; a leg's length adds its own.
    stance : by side, of the own cycle.
    """

    stride_length: float
    sd: float
    stance: Mapping[Side, float]


def leg_frames(
    angles: Mapping[str, PeriodicCurve], left_phase: float, model: BodyModel, side: Side
) -> Array:
    """Frames of the segments (`POINTS`, 14, 3, 4) of the scaled `model` at the phases of the own
    cycle of a `side`, relative to the pelvis in the axes of the world; the other leg is straight.
    `angles` are rad, of `GaitRecord`; `left_phase` is the phase of the right cycle at left heel
    strike.
    """
    phase = np.arange(POINTS) / POINTS
    positions = np.zeros((POINTS, ROOT_DOFS + len(ACTUATED)))
    # The pelvis as both sides saw it, in this side's time.
    other, shift = ("l", -left_phase) if side == "right" else ("r", left_phase)
    pelvis = [
        0.5
        * (
            angles[f"pelvis_{name}_{side[0]}"](phase)
            + sign * angles[f"pelvis_{name}_{other}"](phase + shift)
        )
        for name, sign in (("tilt", 1.0), ("list", -1.0), ("rotation", -1.0))
    ]
    mirror = 1.0 if side == "right" else -1.0
    rotation = pelvis_rotation(pelvis[0], mirror * pelvis[1], mirror * pelvis[2])
    positions[:, :3] = Rotation.from_matrix(rotation).as_rotvec()
    for name in RECORDED_ANGLES:
        column = ROOT_DOFS + ACTUATED.index(f"{name}_{side[0]}")
        positions[:, column] = angles[f"{name}_{side[0]}"](phase)
    return segment_frames(model, positions)


def balls(angles: Mapping[str, PeriodicCurve], left_phase: float, model: BodyModel) -> Array:
    """Where the ball of each foot is relative to the pelvis in its own cycle, (2, `POINTS`, 3) m in
    the axes of the world, right and left; parameters as `leg_frames` takes them.
    """
    found, tree = np.empty((len(SIDES), POINTS, 3)), tree_arrays(model)
    names = [sphere.name for sphere in model.spheres]
    for number, side in enumerate(SIDES):
        frames = leg_frames(angles, left_phase, model, side)
        each = []
        for part in ("medial", "lateral"):
            at = names.index(f"contact_ball_{part}_{side[0]}")
            segment = frames[:, tree.sphere_segment[at]]
            each.append(segment[:, :3, :3] @ tree.sphere_position[at] + segment[:, :3, 3])
        found[number] = 0.5 * (each[0] + each[1])
    return found


def feet(angles: Mapping[str, PeriodicCurve], left_phase: float, model: BodyModel) -> RolledFeet:
    """Stride length and stance of a stride; parameters as `balls` takes them."""
    forward = balls(angles, left_phase, model)[..., 0]
    at = [round(share * POINTS) for share in ROLLING]
    travel = float(np.mean(forward[:, at[0]] - forward[:, at[1]]))
    length = travel / (ROLLING[1] - ROLLING[0]) / TRAVEL.value
    first, last = (round(share * POINTS) for share in TOE_OFF)
    stance: dict[Side, float] = {}
    for number, side in enumerate(SIDES):
        leaves = (first + int(np.argmin(forward[number, first:last]))) / POINTS
        stance[side] = leaves - STANCE_BIAS.value
    return RolledFeet(length, length * TRAVEL.sd / TRAVEL.value, stance)
