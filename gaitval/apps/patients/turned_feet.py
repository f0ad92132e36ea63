"""How far the feet are turned on the shanks, from where they point.

The body's joints have no rotation between the knee's axis and the foot, so a foot points where hip
and pelvis turn it. People's tibias are twisted outwards by 20 degrees or more and vary by 8
(Turner and Smillie 1981, J Bone Joint Surg 63-B:396, from memory), and prosthetic feet are set as
the prosthetist sees fit. The recorded foot progression says by how much: what it differs by in
stance from that of the recorded angles is a constant of the person, and the foot is built turned
by it.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.patients.rolling_foot import POINTS, leg_frames
from gaitval.apps.patients.strides import PersonStrides
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import GaitRecord
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import foot_angles

STANCE: Final = (0.1, 0.5)
"""Of the cycle, in which the foot is flat or rolls over its ball."""
LARGEST: Final = float(np.radians(35.0))
"""rad. Beyond this the angles are of another convention, and the foot is turned by this much."""


def turned_feet(strides: PersonStrides, known: GaitRecord, model: BodyModel) -> dict[Side, float]:
    """By side, the angle by which the foot is turned outwards on the shank, rad. `strides` are as
    recorded, deg; `known` is what the model knows of the same strides, from which what a stride
    lacks is taken; `model` is the body with straight feet.
    """
    found: dict[Side, float] = {}
    phase = np.arange(POINTS) / POINTS
    stands = (phase > STANCE[0]) & (phase < STANCE[1])
    for side in SIDES:
        foot = leg_frames(known.angles, known.left_phase, model, side)
        inwards = foot_angles(foot[:, SEGMENTS.index(f"foot_{side[0]}"), :3, :3], side)[:, 2]
        recorded = np.radians(strides.angles[f"foot_progression_{side[0]}"])
        recorded = np.interp(phase, np.linspace(0.0, 1.0, len(recorded)), recorded)
        turn = float(np.mean((inwards - recorded)[stands]))
        found[side] = float(np.clip(turn, -LARGEST, LARGEST))
    return found


def with_turned_feet(model: BodyModel, turns: Mapping[Side, float]) -> BodyModel:
    """`model` with the feet turned outwards about the vertical through the ankle by `turns`, rad.

    The segments' axes stay, so that the ankle and the toes bend about the same axes as before.
    """
    about: dict[str, Array] = {}
    for side, turn in turns.items():
        matrix = Rotation.from_euler("z", -turn if side == "right" else turn).as_matrix()
        about |= {f"foot_{side[0]}": matrix, f"toes_{side[0]}": matrix}
    segments = tuple(
        replace(
            each,
            joint_position=(
                about[each.name] @ each.joint_position
                if each.name.startswith("toes")
                else each.joint_position
            ),
            centre_of_mass=about[each.name] @ each.centre_of_mass,
            inertia=about[each.name] @ each.inertia @ about[each.name].T,
        )
        if each.name in about
        else each
        for each in model.segments
    )
    spheres = tuple(
        replace(each, position=about[each.segment] @ each.position)
        if each.segment in about
        else each
        for each in model.spheres
    )
    return replace(model, segments=segments, spheres=spheres)
