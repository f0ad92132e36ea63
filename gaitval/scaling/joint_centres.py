"""Joint centres and segment lengths from the markers of a standing trial.

Axes REP-103 (x forward, y left, z up), metres, floor at z = 0. Marker names are those of the
WBDS dataset: `R.` or `L.` and ASIS, PSIS, Knee and Ankle (lateral), Knee.Medial,
Ankle.Medial, Heel, MT1, MT5.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gaitval.errors import ScalingError

Vector = NDArray[np.float64]

LANDMARKS = (
    "ASIS",
    "PSIS",
    "Knee",
    "Knee.Medial",
    "Ankle",
    "Ankle.Medial",
    "Heel",
    "MT1",
    "MT5",
)
"""Markers needed on each side."""

LARGEST_COORDINATE = 20.0
"""A standing person is within this of the origin of the laboratory, m; beyond it the
markers are in millimetres."""

MARKER_OFFSET = 0.010
"""Assumed distance of a marker's centre from the skin, m."""

BALL_TO_FOOT_LENGTH = 0.74
"""Heel to first metatarsal head over heel to toe tip: mean ball-of-foot length 194.8 mm over
mean foot length 263.0 mm of the 6,068 men and women of ANSUR II (Gordon et al. 2014)."""


@dataclass(frozen=True)
class Leg:
    """Measured lengths of one leg, m. Points are in the foot's frame: origin at the ankle
    joint, sole level, x from the heel to the middle of the metatarsal heads, and y towards
    the midline of the body for both legs, so that left and right compare.

    Attributes
    ----------
    thigh, shank : distances between joint centres.
    ankle_height : ankle joint above the floor.
    heel : (3,) rearmost point of the heel, under the marker.
    metatarsals : (2, 3) markers on the first and fifth metatarsal heads.
    """

    thigh: float
    shank: float
    ankle_height: float
    heel: Vector
    metatarsals: Vector

    @property
    def foot_length(self) -> float:
        """Heel to toe tip, m, from the heel to the first metatarsal head."""
        return float(self.metatarsals[0, 0] - self.heel[0]) / BALL_TO_FOOT_LENGTH


@dataclass(frozen=True)
class Measurements:
    """What a standing trial says about a body.

    Attributes
    ----------
    right, left : the legs.
    hip_half_width : hip joint centre to the midline, m.
    hip_height : middle of the hip joint centres above the floor, m.
    pelvic_tilt : forward tilt of the plane of the ASIS and PSIS in standing, rad.
    """

    right: Leg
    left: Leg
    hip_half_width: float
    hip_height: float
    pelvic_tilt: float


def hip_joint_centre(pelvic_width: float, pelvic_depth: float) -> Vector:
    """Right hip joint centre from the middle of the ASIS, m, in the pelvis axes (x forward,
    y left, z up), shape (3,); mirror y for the left one.

    Parameters
    ----------
    pelvic_width : distance between the ASIS, m.
    pelvic_depth : distance between the middle of the ASIS and of the PSIS, m.

    Notes
    -----
    Harrington et al. (2007) J Biomech 40:595-602, the regressions on one variable, in mm:
    x = -0.24 PD - 9.9, up = -0.30 PW - 10.9, lateral = 0.33 PW + 7.3.
    """
    return np.array(
        [
            -0.24 * pelvic_depth - 0.0099,
            -(0.33 * pelvic_width + 0.0073),
            -0.30 * pelvic_width - 0.0109,
        ]
    )


def pelvis_frame(right_asis: Vector, left_asis: Vector, middle_psis: Vector) -> Vector:
    """Axes of the pelvis as columns (x forward, y left, z up), shape (3, 3): y along the
    ASIS, x in the plane of the ASIS and the middle of the PSIS (ISB, Wu et al. 2002).
    """
    y = _unit(left_asis - right_asis)
    forward = (right_asis + left_asis) / 2 - middle_psis
    z = _unit(np.cross(forward, y))
    return np.column_stack([np.cross(y, z), y, z])


def measure(markers: Mapping[str, Sequence[float]]) -> Measurements:
    """Joint centres, segment lengths and pelvic tilt of a standing person.

    Parameters
    ----------
    markers : position of each marker, (3,) m, x forward, y left, z up, floor at z = 0. The
        person may stand anywhere and face anywhere.

    Raises
    ------
    ScalingError : markers missing, not finite, in millimetres, upside down or swapped; all
        problems of a kind are listed.
    """
    points = _points(markers)
    _check_upright(points)
    heading = _heading(points)
    points = {name: heading.T @ point for name, point in points.items()}
    _check_sides(points)

    asis = points["R.ASIS"], points["L.ASIS"]
    middle_asis = (asis[0] + asis[1]) / 2
    middle_psis = (points["R.PSIS"] + points["L.PSIS"]) / 2
    frame = pelvis_frame(*asis, middle_psis)
    right_hip = hip_joint_centre(
        float(np.linalg.norm(asis[1] - asis[0])),
        float(np.linalg.norm(middle_asis - middle_psis)),
    )
    mirror = np.array([1.0, -1.0, 1.0])
    hips = {
        "R": middle_asis + frame @ right_hip,
        "L": middle_asis + frame @ (mirror * right_hip),
    }
    return Measurements(
        right=_leg(points, hips["R"], "R"),
        left=_leg(points, hips["L"], "L"),
        hip_half_width=float(-right_hip[1]),
        hip_height=float(hips["R"][2] + hips["L"][2]) / 2,
        pelvic_tilt=float(np.arcsin(-frame[2, 0])),
    )


def _unit(vector: Vector) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector))


def _fail(problem: str, names: Iterable[str], advice: str) -> None:
    listed = ", ".join(names)
    if listed:
        raise ScalingError(f"{problem}: {listed}. {advice}")


def _points(markers: Mapping[str, Sequence[float]]) -> dict[str, Vector]:
    needed = [f"{side}.{name}" for side in "RL" for name in LANDMARKS]
    _fail(
        "markers missing from the standing trial",
        [name for name in needed if name not in markers],
        "The leg's joint centres cannot be found without them; use a trial with all of: "
        + ", ".join(needed)
        + ".",
    )
    _fail(
        "markers that are not three numbers",
        [name for name in needed if np.shape(markers[name]) != (3,)],
        "A marker is x, y, z in metres.",
    )
    points = {name: np.asarray(markers[name], dtype=np.float64) for name in needed}
    _fail(
        "markers without a finite position (gaps in the standing trial)",
        [name for name, point in points.items() if not np.isfinite(point).all()],
        "Use a frame in which every marker was seen.",
    )
    _fail(
        f"markers more than {LARGEST_COORDINATE:g} m from the laboratory's origin",
        [name for name, p in points.items() if np.abs(p).max() > LARGEST_COORDINATE],
        "They look like millimetres: divide by 1000.",
    )
    return points


def _check_upright(points: Mapping[str, Vector]) -> None:
    chain = ("ASIS", "Knee", "Ankle")
    problems = [
        f"{side}.{lower} ({points[f'{side}.{lower}'][2]:.3f} m) not below "
        f"{side}.{upper} ({points[f'{side}.{upper}'][2]:.3f} m)"
        for side in "RL"
        for upper, lower in pairwise(chain)
        if points[f"{side}.{lower}"][2] >= points[f"{side}.{upper}"][2]
    ]
    _fail(
        "the standing trial is not upright",
        problems,
        "z must point up (axes x forward, y left, z up); check the conversion of the axes.",
    )


def _heading(points: Mapping[str, Vector]) -> Vector:
    """Rotation about z whose x is where the pelvis faces, columns as axes, shape (3, 3)."""
    forward = points["R.ASIS"] + points["L.ASIS"] - points["R.PSIS"] - points["L.PSIS"]
    x = _unit(np.array([forward[0], forward[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    return np.column_stack([x, np.cross(z, x), z])


def _check_sides(points: Mapping[str, Vector]) -> None:
    _fail(
        "left and right markers look swapped (the left one is on the right)",
        [name for name in LANDMARKS if points[f"L.{name}"][1] <= points[f"R.{name}"][1]],
        "y must point to the left of the person, forward being from the PSIS to the ASIS; "
        "check the conversion of the axes and the names of the markers.",
    )
    swapped = [
        f"{side}.{medial} and {side}.{lateral}"
        for side, sign in (("R", 1.0), ("L", -1.0))
        for lateral, medial in (("Knee", "Knee.Medial"), ("Ankle", "Ankle.Medial"), ("MT5", "MT1"))
        if sign * (points[f"{side}.{medial}"][1] - points[f"{side}.{lateral}"][1]) <= 0
    ]
    _fail(
        "medial and lateral markers look swapped",
        swapped,
        "Knee, Ankle and MT5 are the lateral ones; check the names of the markers.",
    )
    _fail(
        "the heel is in front of the toes",
        [f"{s}.Heel and {s}.MT1" for s in "RL" if points[f"{s}.Heel"][0] >= points[f"{s}.MT1"][0]],
        "Check the names of the markers.",
    )


def _leg(points: Mapping[str, Vector], hip: Vector, side: str) -> Leg:
    knee = (points[f"{side}.Knee"] + points[f"{side}.Knee.Medial"]) / 2
    ankle = (points[f"{side}.Ankle"] + points[f"{side}.Ankle.Medial"]) / 2
    heel = points[f"{side}.Heel"]
    metatarsals = np.stack([points[f"{side}.MT1"], points[f"{side}.MT5"]])
    along = metatarsals.mean(axis=0) - heel
    x = _unit(np.array([along[0], along[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    medial = np.cross(z, x) * (1.0 if side == "R" else -1.0)
    frame = np.column_stack([x, medial, z])
    skin = np.array([MARKER_OFFSET, 0.0, 0.0])
    return Leg(
        thigh=float(np.linalg.norm(hip - knee)),
        shank=float(np.linalg.norm(knee - ankle)),
        ankle_height=float(ankle[2]),
        heel=(heel - ankle) @ frame + skin,
        metatarsals=(metatarsals - ankle) @ frame,
    )
