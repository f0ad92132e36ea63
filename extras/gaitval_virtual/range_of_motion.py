"""A range-of-motion trial of a virtual person: what an import would find of hip centres by it.

The person stands, swings one straight leg forward, backward, aside and round, and does the same
with the other. Markers lie on clusters of pelvis and thigh, and on the malleoli. Skin wanders as a
linear function of the two angles of the hip (Bonci et al. 2014, J Biomech 47:2354), so it mimics a
movement of the bone, and of what is new in each swing. The hip centre is the import's own,
`scaling.functional`; the ankle is palpated.

| | size | source |
|---|---|---|
| swing forward and back; aside | 80 ± 10°; 45 ± 5° | as asked for in laboratories |
| skin of pelvis, of thigh, SD each way | 2, 3 mm | so that a centre errs by 13 mm, as in [1] |
| the same, new in each swing | half | chosen |
| camera | 0.5 mm | as `recording` |
| malleoli, each way | 5 mm | [2] |

1. Hicks and Richards 2005, Gait Posture 22:138: 13.4 mm from ultrasound in nine people.
2. Della Croce et al. 2005, Gait Posture 21:226.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.scaling.functional import BallCentre, ball_centre, segment_motion
from gaitval_virtual.recording import CAMERA_NOISE

_CLUSTERS: Final[Mapping[str, tuple[tuple[float, float, float], ...]]] = {
    "pelvis": ((0.09, 0.12, 0.08), (0.09, -0.12, 0.08), (-0.10, 0.05, 0.09), (-0.10, -0.05, 0.09)),
    "thigh": ((0.06, 0.03, -0.4), (0.02, 0.08, -0.5), (0.0, 0.05, -1.0), (0.0, -0.05, -1.0)),
}
"""m forward, out of the body (left, of the pelvis), up in the segments' frames; the thigh's in
lengths of the thigh: the last two are the epicondyles."""
_SKIN: Final = {"pelvis": 0.002, "thigh": 0.003}
_EACH_SWING: Final = 0.5
_MALLEOLI: Final = 0.005
_SWINGS: Final = 8
_FRAMES: Final = 40
"""Of a swing: 20 a second."""


@dataclass(frozen=True)
class FoundHip:
    """What an import says of one hip; axes of the pelvis are forward, left, up.

    Attributes
    ----------
    found : the functional centre, m, in the pelvis' frame.
    to_ankle : m, from it down to the ankle's centre.
    """

    found: BallCentre
    to_ankle: float


def _swings(random: np.random.Generator) -> Array:
    """(T, 2) rad, flexion and abduction of a hip: swings to and fro in directions all around."""
    forward, aside = np.radians([40.0 + random.uniform(-5, 5), 22.5 + random.uniform(-2.5, 2.5)])
    phase = np.linspace(0.0, 2.0 * np.pi, _FRAMES, endpoint=False)
    found = []
    for direction in np.pi * np.arange(_SWINGS) / _SWINGS:
        away = np.sin(phase)[:, None] * np.array([np.cos(direction), np.sin(direction)])
        found.append(away * [forward, aside] + [np.radians(15.0), np.radians(10.0)])
    # and once round
    found.append(
        np.stack([forward * np.cos(phase), aside * np.sin(phase)], axis=1) + np.radians([15.0, 10])
    )
    return np.concatenate(found)


def _wandering(swings: Array, count: int, size: float, random: np.random.Generator) -> Array:
    """(T, count, 3) m, by which skin carries each marker away from the bone."""
    scaled = (swings - swings.mean(axis=0)) / swings.std(axis=0)
    linear = np.einsum("tk,kmi->tmi", scaled, random.normal(0.0, size, (2, count, 3)) / np.sqrt(2))
    times = len(swings) // _FRAMES
    new = random.normal(0.0, _EACH_SWING * size, (times, 2, count, 3))
    phase = np.linspace(0.0, 2.0 * np.pi, _FRAMES, endpoint=False)
    waves = np.stack([np.cos(phase), np.sin(phase)])
    each = np.einsum("kt,skmi->stmi", waves, new).reshape(len(swings), count, 3)
    noise = random.normal(0.0, CAMERA_NOISE, linear.shape)
    return np.asarray(linear + each + noise)


def functional_hips(body: BodyModel, random: np.random.Generator) -> dict[Side, FoundHip]:
    """Both hips of a body as an import would find them.

    Parameters
    ----------
    body : of the person.
    random : generator to draw movement, skin and palpation from.

    Raises
    ------
    ScalingError : a hip did not turn enough; not with the swings of this module.
    """
    found: dict[Side, FoundHip] = {}
    rest = segment_frames(body, np.zeros((1, len(COORDINATES))))[0]
    for side in SIDES:
        letter, out = side[0], 1.0 if side == "left" else -1.0
        swings = _swings(random)
        poses = np.zeros((len(swings), len(COORDINATES)))
        poses[:, COORDINATES.index(f"hip_flexion_{letter}")] = swings[:, 0]
        poses[:, COORDINATES.index(f"hip_adduction_{letter}")] = -swings[:, 1]
        frames = segment_frames(body, poses)
        motions = []
        for segment, name in (("pelvis", "pelvis"), ("thigh", f"thigh_{letter}")):
            places = np.array(_CLUSTERS[segment])
            if segment == "thigh":
                places = places * [1.0, out, -body[f"shank_{letter}"].joint_position[2]]
            index = SEGMENTS.index(name)
            standing = places @ rest[index, :3, :3].T + rest[index, :3, 3]
            moving = np.einsum("tij,mj->tmi", frames[:, index, :3, :3], places)
            moving += frames[:, index, None, :3, 3]
            moving += _wandering(swings, len(places), _SKIN[segment], random)
            motions.append(segment_motion(standing, moving, name))
        hip = rest[SEGMENTS.index(f"thigh_{letter}"), :3, 3]
        centre = ball_centre(motions[0], motions[1], hip + random.normal(0.0, 0.01, 3))
        ankle = rest[SEGMENTS.index(f"foot_{letter}"), :3, 3] + random.normal(0.0, _MALLEOLI, 3)
        found[side] = FoundHip(centre, float(centre.centre[2] - ankle[2]))
    return found
