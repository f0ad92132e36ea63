"""The body model: fourteen rigid segments, their joints and the contact spheres of the feet.

Scaling passes this type to every later stage. It is stored as a URDF file.
"""

import math
from dataclasses import dataclass
from typing import Final

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.model.ground import LEVEL, Ground

_JOINTS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "thigh_r": ("pelvis", ("hip_flexion_r", "hip_adduction_r", "hip_rotation_r")),
    "shank_r": ("thigh_r", ("knee_angle_r",)),
    "foot_r": ("shank_r", ("ankle_angle_r", "subtalar_angle_r")),
    "toes_r": ("foot_r", ("mtp_angle_r",)),
    "thigh_l": ("pelvis", ("hip_flexion_l", "hip_adduction_l", "hip_rotation_l")),
    "shank_l": ("thigh_l", ("knee_angle_l",)),
    "foot_l": ("shank_l", ("ankle_angle_l", "subtalar_angle_l")),
    "toes_l": ("foot_l", ("mtp_angle_l",)),
    "torso": ("pelvis", ("lumbar_extension", "lumbar_bending", "lumbar_rotation")),
    "upper_arm_r": ("torso", ("arm_flex_r", "arm_add_r", "arm_rot_r")),
    "forearm_r": ("upper_arm_r", ("elbow_flex_r",)),
    "upper_arm_l": ("torso", ("arm_flex_l", "arm_add_l", "arm_rot_l")),
    "forearm_l": ("upper_arm_l", ("elbow_flex_l",)),
}
"""Parent of each segment but the pelvis, and the coordinates of the joint between them."""

SEGMENTS = ("pelvis", *_JOINTS)
"""Segment names, each parent before its children; the order of every per-segment array."""

PARENTS = {name: parent for name, (parent, _) in _JOINTS.items()}

JOINT_COORDINATES = {name: coordinates for name, (_, coordinates) in _JOINTS.items()}
"""Coordinates of the joint between a segment and its parent, outermost rotation first."""

_SIDE: Final[dict[str, Side]] = {"_r": "right", "_l": "left"}


@dataclass(frozen=True)
class Segment:
    """One rigid segment. Its frame is at the joint to its parent; its axes are the world's
    (REP-103: x forward, y left, z up) when all coordinates are zero.

    Attributes
    ----------
    name : segment name, one of `SEGMENTS`.
    joint_position : (3,) m, the segment's joint in the parent's frame; zero for the pelvis.
    mass : kg.
    centre_of_mass : (3,) m, in the segment's frame.
    inertia : (3, 3) kg m², about the centre of mass, in the segment's axes.
    """

    name: str
    joint_position: Array
    mass: float
    centre_of_mass: Array
    inertia: Array

    @property
    def side(self) -> Side | None:
        """The side of an arm or leg; None in the middle of the body."""
        return _SIDE.get(self.name[-2:])

    @property
    def kind(self) -> str:
        """The name without the side."""
        return self.name if self.side is None else self.name[:-2]


@dataclass(frozen=True)
class ContactSphere:
    """A Hunt-Crossley sphere. `position` is (3,) m in the frame of `segment`; `radius` m."""

    name: str
    segment: str
    position: Array
    radius: float


@dataclass(frozen=True)
class BodyModel:
    """A person's body: segments in the order of `SEGMENTS`, and twelve foot spheres (six per foot,
    right foot first); and the `ground` that it is on, in whose axes gravity is.
    """

    name: str
    segments: tuple[Segment, ...]
    spheres: tuple[ContactSphere, ...]
    ground: Ground = LEVEL

    def __getitem__(self, name: str) -> Segment:
        return self.segments[SEGMENTS.index(name)]

    @property
    def mass(self) -> float:
        """Total mass, kg."""
        # Python's own sum rounds otherwise from version 3.12 on.
        return math.fsum(segment.mass for segment in self.segments)

    @property
    def leg_length(self) -> float:
        """From hip to ankle with a straight knee, mean of both sides, m."""
        joints = [self[f"{name}_{side}"] for name in ("shank", "foot") for side in "rl"]
        return float(-0.5 * sum(joint.joint_position[2] for joint in joints))
