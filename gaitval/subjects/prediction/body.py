"""What the lengths of a body add to its angles: how wide it steps, and how wide its pelvis is.

Both act on kinetics as levers. Sideways the body is a pendulum over its feet (Hof et al. 2005, J
Biomech 38:1-8), so that at the same timing the medial force is as large as the distance sideways
between the feet. And laboratories put hip centres behind the ASIS by a share of the distance
between these (Bell et al. 1990, J Biomech 23:617-621), which the moments are then about: at the hip
they differ by the vertical force times a share of that distance.
"""

from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError
from gaitval.gait.record import GaitRecord
from gaitval.scaling.joint_centres import measure, pelvis_frame
from gaitval.scaling.measurements import Limbs, Measurements
from gaitval.scaling.scaling import measurements_of
from gaitval.subjects.subject import Subject

_DOUBLE_SUPPORT: Final = np.array([0.02, 0.05, 0.08])
"""Phases of the gait cycle of the leg in front at which both feet carry."""
_MIDDLE_OF_STANCE: Final = np.arange(0.15, 0.5, 0.01)
_BELL: Final = np.array([-0.19, -0.36, -0.30])
"""Right hip centre from the middle of the ASIS in the pelvis' axes, over the distance between the
ASIS (Bell et al. 1990): what Visual3D builds a pelvis with."""


def pelvic_width(subject: Subject) -> float:
    """Distance between the ASIS of the standing trial, m; NaN without their markers."""
    if not {"R.ASIS", "L.ASIS"} <= subject.markers.keys():
        return float("nan")
    right, left = (np.array(subject.markers[f"{side}.ASIS"]) for side in "RL")
    return float(np.linalg.norm(left - right))


def step_width(subject: Subject, record: GaitRecord) -> float:
    """Distance sideways between the lines through the ankles and the metatarsal heads of both feet
    when both are on the ground, over leg length, from the angles of `record`; NaN if the lengths of
    the body or the foot progression angles are unknown.

    Knee adduction and rotation count where they were recorded: the angles then put the ankle where
    the laboratory saw it.
    """
    lengths = _lengths(subject)
    if lengths is None or not {f"foot_progression_{s}" for s in "rl"} <= record.angles.keys():
        return float("nan")
    apart = []
    for front, back in (SIDES, SIDES[::-1]):
        later = record.left_phase if front == "right" else -record.left_phase
        apart += [
            _ankle_outward(record, front, lengths, _DOUBLE_SUPPORT)
            + _ankle_outward(record, back, lengths, _DOUBLE_SUPPORT - later)
        ]
    toes = sum(_toes_outward(record, side, lengths) for side in SIDES)
    return float(np.mean(apart) + toes) / subject.leg_length_m


def _lengths(subject: Subject) -> Measurements | None:
    """Of the body whose joint centres the angles of `subject` are about."""
    try:
        if subject.measurements:
            return measurements_of(subject)
        return measure(subject.markers, centres=_hips(subject)) if subject.markers else None
    except ScalingError:
        return None


def _hips(subject: Subject) -> dict[str, Array]:
    at = {name: np.array(place, float) for name, place in subject.markers.items()}
    right, left, back = at["R.ASIS"], at["L.ASIS"], (at["R.PSIS"] + at["L.PSIS"]) / 2
    frame, from_asis = pelvis_frame(right, left, back), np.linalg.norm(left - right) * _BELL
    return {
        f"{side}.Hip.Centre": (right + left) / 2
        + frame @ (from_asis * np.array([1.0, mirror, 1.0]))
        for side, mirror in (("R", 1.0), ("L", -1.0))
    }


def _toes_outward(record: GaitRecord, side: Side, lengths: Measurements) -> float:
    """How far the metatarsal heads are outward of the ankle, m, mean in the middle of stance."""
    turned = record.angles[f"foot_progression_{side[0]}"](_MIDDLE_OF_STANCE).mean()
    ahead = np.mean([place[0] for place in _limbs(lengths, side).metatarsals])
    return -float(ahead * np.sin(turned))


def _limbs(lengths: Measurements, side: Side) -> Limbs:
    return lengths.right if side == "right" else lengths.left


def _ankle_outward(record: GaitRecord, side: Side, lengths: Measurements, phase: Array) -> Array:
    """(n,) how far the ankle of a `side` is outward of the middle of the hips, m, at phases (n,) of
    that side's cycle.
    """
    mirror = 1.0 if side == "right" else -1.0

    def angle(name: str) -> Array:
        curve = record.angles.get(f"{name}_{side[0]}")
        return np.zeros(len(phase)) if curve is None else np.asarray(curve(phase))

    pelvis = (
        _about(2, mirror * angle("pelvis_rotation"))
        @ _about(0, -mirror * angle("pelvis_list"))
        @ _about(1, angle("pelvis_tilt"))
    )
    thigh = (
        pelvis
        @ _about(1, -angle("hip_flexion"))
        @ _about(0, mirror * angle("hip_adduction"))
        @ _about(2, mirror * angle("hip_rotation"))
    )
    shank = (
        thigh
        @ _about(1, angle("knee_angle"))
        @ _about(0, mirror * angle("knee_adduction"))
        @ _about(2, mirror * angle("knee_rotation"))
    )
    limbs = _limbs(lengths, side)
    # Of a segment along -z only the last column counts, of the hip's offset the middle one.
    left = (
        -mirror * lengths.hip_half_width * pelvis[:, 1, 1]
        - limbs.thigh * thigh[:, 1, 2]
        - limbs.shank * shank[:, 1, 2]
    )
    return np.asarray(-mirror * left)


def _about(axis: int, angles: Array) -> Array:
    """(n, 3, 3) rotations by `angles` (n,) about x, y or z."""
    turned = np.zeros((len(angles), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned[:, axis, axis] = 1.0
    turned[:, i, i] = turned[:, j, j] = np.cos(angles)
    turned[:, j, i] = np.sin(angles)
    turned[:, i, j] = -turned[:, j, i]
    return turned
