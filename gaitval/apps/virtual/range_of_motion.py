"""A range-of-motion trial of a virtual person: what an import would find of hips and knees by it.

The person stands, swings one straight leg forward, backward, aside and round, bends its knee, and
does the same with the other. Markers lie on clusters of pelvis, thigh and shank, and on epicondyles
and malleoli. Skin wanders as a linear function of the angles that move (Bonci et al. 2014,
J Biomech 47:2354), so it mimics a movement of the bone, and of what is new in each swing. Hip
centre and knee axis are the import's own, `scaling.functional`; knee and ankle are palpated.

| | size | source |
|---|---|---|
| swing forward and back; aside | 80 ± 10°; 45 ± 5° | as asked for in laboratories |
| knee | 0 to 80 ± 10° | as asked for in laboratories |
| skin of pelvis, of thigh, SD each way | 2, 3 mm | so that a centre errs by 13 mm, as in [1] |
| the knee bending: of thigh, of shank | 5, 3 mm | [3]: up to 30, up to 15 mm |
| the same, new in each swing | half | chosen |
| camera | 0.5 mm | as `recording` |
| malleoli, epicondyles, each way | 5 mm | [2] |

1. Hicks and Richards 2005, Gait Posture 22:138: 13.4 mm from ultrasound in nine people.
2. Della Croce et al. 2005, Gait Posture 21:226.
3. Leardini et al. 2005, Gait Posture 21:212.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.apps.virtual.recording import CAMERA_NOISE
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.scaling.functional import (
    BallCentre,
    HingeAxis,
    SegmentMotion,
    ball_centre,
    hinge_axis,
    segment_motion,
)

_CLUSTERS: Final[Mapping[str, tuple[tuple[float, float, float], ...]]] = {
    "pelvis": ((0.09, 0.12, 0.08), (0.09, -0.12, 0.08), (-0.10, 0.05, 0.09), (-0.10, -0.05, 0.09)),
    "thigh": ((0.06, 0.03, -0.4), (0.02, 0.08, -0.5), (0.0, 0.05, -1.0), (0.0, -0.05, -1.0)),
    "shank": ((0.04, 0.02, -0.3), (0.03, -0.03, -0.5), (0.0, 0.04, -1.0), (0.0, -0.04, -1.0)),
}
"""m forward, out of the body (left, of the pelvis), up in the segments' frames; up in lengths of
the segment but for the pelvis: the last two are epicondyles and malleoli."""
_BELOW: Final = {"thigh": "shank", "shank": "foot"}
_SWINGING: Final = {"pelvis": 0.002, "thigh": 0.003}
_BENDING: Final = {"thigh": 0.005, "shank": 0.003}
"""Skin, m."""
_EACH_SWING: Final = 0.5
_PALPATION: Final = 0.005
_SWINGS: Final = 8
_FRAMES: Final = 40
"""Of a swing: 20 a second."""


@dataclass(frozen=True)
class FoundLeg:
    """What an import says of one leg; m in the pelvis' frame, whose axes are forward, left, up.

    Attributes
    ----------
    hip : the functional centre.
    knee : the functional axis, nearest to the palpated centre.
    palpated_knee, ankle : (3,) palpated centres.
    """

    hip: BallCentre
    knee: HingeAxis
    palpated_knee: Array
    ankle: Array


def _swings(random: np.random.Generator) -> Array:
    """(T, 2) rad, flexion and abduction of a hip: swings to and fro in directions all around."""
    forward, aside = np.radians([40.0 + random.uniform(-5, 5), 22.5 + random.uniform(-2.5, 2.5)])
    phase = _phase()
    found = []
    for direction in np.pi * np.arange(_SWINGS) / _SWINGS:
        away = np.sin(phase)[:, None] * np.array([np.cos(direction), np.sin(direction)])
        found.append(away * [forward, aside] + [np.radians(15.0), np.radians(10.0)])
    # and once round
    found.append(
        np.stack([forward * np.cos(phase), aside * np.sin(phase)], axis=1) + np.radians([15.0, 10])
    )
    return np.concatenate(found)


def _bends(random: np.random.Generator) -> Array:
    """(T, 1) rad, flexion of a knee."""
    furthest = np.radians(80.0 + random.uniform(-10, 10, _SWINGS))
    return np.asarray((furthest[:, None] * (1.0 - np.cos(_phase())) / 2.0).reshape(-1, 1))


def _phase() -> Array:
    return np.linspace(0.0, 2.0 * np.pi, _FRAMES, endpoint=False)


def _wandering(swings: Array, count: int, size: float, random: np.random.Generator) -> Array:
    """(T, count, 3) m, by which skin carries each marker away from the bone; swings (T, K)."""
    scaled = (swings - swings.mean(axis=0)) / swings.std(axis=0)
    angles = scaled.shape[1]
    slopes = random.normal(0.0, size, (angles, count, 3)) / np.sqrt(angles)
    linear = np.einsum("tk,kmi->tmi", scaled, slopes)
    times = len(swings) // _FRAMES
    new = random.normal(0.0, _EACH_SWING * size, (times, 2, count, 3))
    waves = np.stack([np.cos(_phase()), np.sin(_phase())])
    each = np.einsum("kt,skmi->stmi", waves, new).reshape(len(swings), count, 3)
    noise = random.normal(0.0, CAMERA_NOISE, linear.shape)
    return np.asarray(linear + each + noise)


def _motions(
    body: BodyModel,
    side: Side,
    angles: Mapping[str, Array],
    skin: Mapping[str, float],
    random: np.random.Generator,
) -> list[SegmentMotion]:
    """Motions of the segments of one side with `skin` of these sizes, m, as the coordinates of
    `angles` (T,) rad move.
    """
    driven = np.stack(list(angles.values()), axis=1)
    poses = np.zeros((len(driven), len(COORDINATES)))
    poses[:, [COORDINATES.index(name) for name in angles]] = driven
    frames, rest = segment_frames(body, poses), segment_frames(body, 0.0 * poses[:1])[0]
    motions = []
    for segment, size in skin.items():
        places, name = np.array(_CLUSTERS[segment]), segment
        if segment in _BELOW:
            name = f"{segment}_{side[0]}"
            length = -body[f"{_BELOW[segment]}_{side[0]}"].joint_position[2]
            places = places * [1.0, 1.0 if side == "left" else -1.0, length]
        index = SEGMENTS.index(name)
        standing = places @ rest[index, :3, :3].T + rest[index, :3, 3]
        seen = np.einsum("tij,mj->tmi", frames[:, index, :3, :3], places)
        seen += frames[:, index, None, :3, 3] + _wandering(driven, len(places), size, random)
        motions.append(segment_motion(standing, seen, name))
    return motions


def functional_legs(body: BodyModel, random: np.random.Generator) -> dict[Side, FoundLeg]:
    """Both legs of a person's `body` as an import would find them; movement, skin and palpation are
    drawn with the generator `random`. Raises ScalingError if a joint did not turn enough; not with
    the swings of this module.
    """
    found: dict[Side, FoundLeg] = {}
    rest = segment_frames(body, np.zeros((1, len(COORDINATES))))[0]
    for side in SIDES:
        letter = side[0]
        hip, knee, ankle = (
            rest[SEGMENTS.index(f"{name}_{letter}"), :3, 3] for name in ("thigh", "shank", "foot")
        )
        swings, bends = _swings(random), _bends(random)
        angles = {f"hip_flexion_{letter}": swings[:, 0], f"hip_adduction_{letter}": -swings[:, 1]}
        swung = _motions(body, side, angles, _SWINGING, random)
        bent = _motions(body, side, {f"knee_angle_{letter}": bends[:, 0]}, _BENDING, random)
        palpated = knee + random.normal(0.0, _PALPATION, 3)
        found[side] = FoundLeg(
            hip=ball_centre(swung[0], swung[1], hip + random.normal(0.0, 0.01, 3)),
            knee=hinge_axis(bent[0], bent[1], palpated, np.array([0.0, 1.0, 0.0])),
            palpated_knee=palpated,
            ankle=ankle + random.normal(0.0, _PALPATION, 3),
        )
    return found
