"""Names, order, axes and signs of the 31 coordinates of the humanoid.

Axes follow REP-103: x forward, y left, z up. Joint coordinates follow the clinical convention on
both sides of the body, so a positive value means the same movement left and right: flexion
(dorsiflexion, toe extension), adduction (inversion), internal rotation. The names are OpenSim's
(Rajagopal et al. 2016). Each coordinate of a joint rotates about a fixed axis of the frame left by
the previous coordinate: flexion, adduction, rotation (the ISB order; Grood and Suntay 1983).

| coordinate        | axis, right side | axis, left side | positive                         |
|-------------------|------------------|-----------------|----------------------------------|
| hip_flexion       | -y               | -y              | thigh forward                    |
| hip_adduction     | +x               | -x              | thigh towards the midline        |
| hip_rotation      | +z               | -z              | toes towards the midline         |
| knee_angle        | +y               | +y              | flexion (shank backward)         |
| ankle_angle       | -y               | -y              | dorsiflexion (toes up)           |
| subtalar_angle    | +x               | -x              | inversion (sole to the midline)  |
| mtp_angle         | -y               | -y              | extension (toes up)              |
| lumbar_extension  | -y               |                 | trunk backward                   |
| lumbar_bending    | +x               |                 | trunk to the right               |
| lumbar_rotation   | +z               |                 | trunk turned to the left         |
| arm_flex          | -y               | -y              | arm forward                      |
| arm_add           | +x               | -x              | arm towards the midline          |
| arm_rot           | +z               | -z              | internal rotation                |
| elbow_flex        | -y               | -y              | forearm forward                  |

The pelvis (root) has six coordinates, as in `dartpy`'s FreeJoint: a rotation vector in world axes,
then the position of its origin, the middle of the hip joint centres.
"""

from collections.abc import Mapping
from typing import Final, Literal

Side = Literal["right", "left"]
SIDES: Final[tuple[Side, Side]] = ("right", "left")
_Axis = tuple[float, float, float]


def opposite(side: Side) -> Side:
    """The other side of the body than `side`."""
    return "left" if side == "right" else "right"


def split_side(name: str) -> tuple[str, str]:
    """Side and name without side of the coordinate `name`: `("right", "knee_angle")` of
    `"knee_angle_r"`; the side is `""` for the midline.
    """
    side = {"_r": "right", "_l": "left"}.get(name[-2:], "")
    return side, name[:-2] if side else name


ROOT: Final = ("pelvis_rx", "pelvis_ry", "pelvis_rz", "pelvis_tx", "pelvis_ty", "pelvis_tz")

LEG: Final = (
    "hip_flexion",
    "hip_adduction",
    "hip_rotation",
    "knee_angle",
    "ankle_angle",
    "subtalar_angle",
    "mtp_angle",
)
ARM: Final = ("arm_flex", "arm_add", "arm_rot", "elbow_flex")
"""Coordinates of a leg and of an arm, without their side."""

LUMBAR: Final = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")

ACTUATED: Final[tuple[str, ...]] = (
    *(f"{name}_r" for name in LEG),
    *(f"{name}_l" for name in LEG),
    *LUMBAR,
    *(f"{name}_r" for name in ARM),
    *(f"{name}_l" for name in ARM),
)
"""The 25 actuated coordinates, in the order of every array of joint angles and moments."""

COORDINATES: Final[tuple[str, ...]] = (*ROOT, *ACTUATED)
"""All 31 coordinates, root first."""

_TURNS: Final[Mapping[str, tuple[_Axis, tuple[float, float]]]] = {
    "hip_flexion": ((0, -1, 0), (-0.7, 2.3)),
    "hip_adduction": ((1, 0, 0), (-0.9, 0.7)),
    "hip_rotation": ((0, 0, 1), (-0.9, 0.9)),
    "knee_angle": ((0, 1, 0), (-0.09, 2.6)),
    "ankle_angle": ((0, -1, 0), (-1.05, 0.7)),
    "subtalar_angle": ((1, 0, 0), (-0.6, 0.6)),
    "mtp_angle": ((0, -1, 0), (-0.8, 1.4)),
    "lumbar_extension": ((0, -1, 0), (-1.6, 0.7)),
    "lumbar_bending": ((1, 0, 0), (-0.7, 0.7)),
    "lumbar_rotation": ((0, 0, 1), (-0.8, 0.8)),
    "arm_flex": ((0, -1, 0), (-1.1, 3.1)),
    "arm_add": ((1, 0, 0), (-3.1, 0.7)),
    "arm_rot": ((0, 0, 1), (-1.6, 1.6)),
    "elbow_flex": ((0, -1, 0), (-0.18, 2.7)),
}
"""Axis, on the right side, and range of each actuated coordinate."""


def _axis(name: str) -> _Axis:
    side, joint = split_side(name)
    x, y, z = _TURNS[joint][0]
    # Left axes of adduction, inversion and internal rotation point the other way, so that a
    # positive value means the same movement; flexion turns about the transverse axis, which both
    # sides share.
    return (-x, y, -z) if side == "left" else (x, y, z)


AXES: Final[dict[str, _Axis]] = {name: _axis(name) for name in ACTUATED}
"""Axis of each actuated coordinate in the parent's frame at the neutral pose (REP-103)."""

RANGES: Final[dict[str, tuple[float, float]]] = {
    name: _TURNS[split_side(name)[1]][1] for name in ACTUATED
}
"""Lowest and highest value of each actuated coordinate, rad: ranges of motion of healthy adults
(AAOS 1965; Soucie et al. 2011, Haemophilia 17:500), with 5 and 10 degrees of hyperextension allowed
at the knee and elbow."""


def mirrored(name: str) -> str:
    """The coordinate `name` on the other side, whose sign needs no change: see the table above.
    Those of the midline keep their name, but bending and rotation of the trunk change sign.
    """
    if name.endswith("_r"):
        return name[:-1] + "l"
    if name.endswith("_l"):
        return name[:-1] + "r"
    return name
