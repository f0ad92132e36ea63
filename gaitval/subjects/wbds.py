"""The columns of mean curves of the gait dataset of Fukuchi, Fukuchi & Duarte (2018).

PeerJ 6:e4640, https://doi.org/10.7717/peerj.4640, data CC BY 4.0. This is the only place where its
conventions (millimetres, degrees, N/kg, axes x forward, y up, z right) become the project's.

Signs. The dataset's angle about X is adduction (ankle: inversion), about Y internal rotation,
about Z flexion (ankle: dorsiflexion), positive on both sides; the foot's angle about Y is
positive toes outwards (it follows the chain pelvis-hip-knee-ankle with a minus sign, while X
and Z follow with a plus).

Moments are internal. About Z: hip flexion, knee extension, ankle plantarflexion positive. About X:
hip and knee abduction, ankle inversion positive. About Y: external rotation positive. The files do
not state X and Y. They were found from the ten subjects in stance: the knee's moment less the
ankle's must equal shank x ground reaction, the hip's less the knee's thigh x ground reaction. With
each moment in the axes of its distal segment, these signs leave the least, 0.19 (hip, knee) and
0.27 Nm/kg root-mean-square (knee, ankle), and changing any one leaves more
(`tests/datasets/test_signs.py`). The same signs are also best with the knee's moment in the thigh's
or the laboratory's axes, which fit the ankle's moment better (0.23, 0.20). So the signs are
certain, but the axes of the frontal and transverse moments are not, and the ankle's inversion sign
is the least certain (it depends on using the foot's axes).

The moments show a calibration error of the force plates against the markers: over the ten subjects
the ankle moment divided by vertical force at 45 % of the cycle is 0.14 m on the right and 0.10 m on
the left, a difference that no gait has (docs/paper.md). The curves are left as recorded; the files
of the built-in subjects have the correction beside them.
"""

from collections.abc import Mapping
from typing import Final

from gaitval.coordinates import SIDES, Side

_LETTER: Final[dict[Side, str]] = {"right": "R", "left": "L"}

MOMENT_SEAM: Final = (97, 98, 99)
"""Rows where the moments jump, an edge effect of the authors' filter; left out of the fit."""

# Project name and sign (to the project's convention) of each column, without its side.
_ANGLES: Final[dict[str, tuple[str, int]]] = {
    "PelvisAngleX": ("pelvis_list", 1),
    "PelvisAngleY": ("pelvis_rotation", 1),
    "PelvisAngleZ": ("pelvis_tilt", 1),
    "HipAngleX": ("hip_adduction", 1),
    "HipAngleY": ("hip_rotation", 1),
    "HipAngleZ": ("hip_flexion", 1),
    "KneeAngleX": ("knee_adduction", 1),
    "KneeAngleY": ("knee_rotation", 1),
    "KneeAngleZ": ("knee_angle", 1),
    "AnkleAngleX": ("subtalar_angle", 1),
    "AnkleAngleY": ("ankle_rotation", 1),
    "AnkleAngleZ": ("ankle_angle", 1),
    "FootAngleX": ("foot_list", 1),
    "FootAngleY": ("foot_progression", -1),
    "FootAngleZ": ("foot_pitch", 1),
}
_MOMENTS: Final[dict[str, tuple[str, int]]] = {
    "HipMomentX": ("hip_adduction", -1),
    "HipMomentY": ("hip_rotation", -1),
    "HipMomentZ": ("hip_flexion", 1),
    "KneeMomentX": ("knee_adduction", -1),
    "KneeMomentY": ("knee_rotation", -1),
    "KneeMomentZ": ("knee_angle", -1),
    "AnkleMomentX": ("subtalar_angle", 1),
    "AnkleMomentY": ("ankle_rotation", -1),
    "AnkleMomentZ": ("ankle_angle", -1),
}
_FORCES: Final = {"GRFX": "forward", "GRFY": "up", "GRFZ": "left"}


def _columns() -> dict[str, tuple[str, int, str]]:
    found = {}
    for side in SIDES:
        letter, end = _LETTER[side], side[0]
        for column, (name, sign) in _ANGLES.items():
            found[f"{letter}{column}"] = f"angle_{name}_{end}", sign, "deg"
        for column, (name, sign) in _MOMENTS.items():
            found[f"{letter}{column}"] = f"moment_{name}_{end}", sign, "Nm/kg"
        for column, name in _FORCES.items():
            # Towards the midline is to the left for the right foot, to the right for the left one.
            sign = -1 if (name, side) == ("left", "left") else 1
            found[f"{letter}{column}"] = f"force_{name}_{end}", sign, "N/kg"
    return found


COLUMNS: Final[Mapping[str, tuple[str, int, str]]] = _columns()
"""Name of a curve, its sign and its unit, by the column of `…ang.txt` or `…knt.txt`."""
