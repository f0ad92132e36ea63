"""The standing pose of a body, and the landmarks of a person with this body."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import enter_rotation_vector, segment_frames
from gaitval.scaling.foot_shape import FOOT_SHAPE
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.joint_centres import SURFACE
from gaitval.scaling.measurements import Limbs, Measurements

KNEE_WIDTH: Final = 0.102
ANKLE_WIDTH: Final = 0.068
ELBOW_WIDTH: Final = 0.066
"""m, across the joint, of a made-up person: near the means of women in ANSUR II (Gordon et al.
2014)."""
PELVIC_DEPTH: Final = 0.19
"""m, from the middle of the ASIS back to that of the PSIS, of a made-up person."""
_LEAN: Final = 3.0
"""Degrees by which the thighs lean forward in standing; the knees are bent by twice that, and the
ankles by once, so that the soles lie flat."""
_OTHER: Final = {"arm_flex": 4.0, "arm_add": -9.0, "elbow_flex": 20.0}
"""Degrees, both sides."""
UP: Final = np.array([0.0, 0.0, 1.0])


def standing_pose(
    model: BodyModel,
    ankle_height: float,
    *,
    tilt: float,
    heading: float = 0.0,
    toe_out: Mapping[str, float] | None = None,
    raised: float = 0.0,
) -> Array:
    """Coordinates (31,), rad and m, of a body that stands with knees a little bent, trunk upright
    and arms hanging.

    Parameters
    ----------
    model : the scaled body.
    ankle_height : m, of the ankle joint above the floor.
    tilt : degrees, forward tilt of the pelvis, see `Measurements.pelvic_tilt`.
    heading : degrees to the left of x.
    toe_out : degrees, of each side ("r", "l"). The hip turns the leg about the thigh, which leans
        by 3°: a foot turned by 7° stands 0.4° on its edge, and standing is where inversion is zero.
    raised : degrees of arm abduction, instead of hanging arms.
    """
    angles = {
        "pelvis_tilt": tilt,
        "hip_flexion": tilt + _LEAN,
        "knee_angle": 2.0 * _LEAN,
        "ankle_angle": _LEAN,
        "lumbar_extension": tilt,
        **_OTHER,
    }
    pose = np.zeros(len(COORDINATES))
    for name, value in angles.items():
        for coordinate in (name, f"{name}_r", f"{name}_l"):
            if coordinate in COORDINATES:
                pose[COORDINATES.index(coordinate)] = np.radians(value)
    for side in "rl":
        if toe_out:
            pose[COORDINATES.index(f"hip_rotation_{side}")] = -np.radians(toe_out[side])
        if raised:
            pose[COORDINATES.index(f"arm_add_{side}")] = -np.radians(raised)
    a, b = np.radians(tilt), np.radians(heading)
    cz, sz, cy, sy = np.cos(b), np.sin(b), np.cos(a), np.sin(a)
    # Heading about z after tilt about y: the pelvis tilts in its own sagittal plane.
    turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    enter_rotation_vector(turn, pose[:3])
    # Any place on the floor: nothing may depend on where a person stands. The height is set so that
    # the ankle is where it was measured.
    pose[3:6] = 0.4, -0.3, 0.0
    ankle = segment_frames(model, pose[None])[0, SEGMENTS.index("foot_r"), 2, 3]
    pose[5] = ankle_height - ankle
    return pose


def landmarks_on(
    measured: Measurements, frames: Array, girdles: Mapping[str, Array] | None = None
) -> dict[str, Array]:
    """Where the landmarks (`scaling.landmarks`) of a standing person are, (3,) m. `measured` is of
    legs that are equal; without arms the landmarks of the arms are left out. `frames` (14, 4, 4)
    are of the segments; `girdles` say of each side ("r", "l") by how much the shoulder girdle has
    moved, m.

    The joints are where the frames have them, so scaling finds this body again: the pelvis is as
    wide as the regression of the hip centres has it for `measured.hip_half_width`.
    """

    def at(segment: str, place: Array | tuple[float, float, float]) -> Array:
        frame = frames[SEGMENTS.index(segment)]
        return np.asarray(frame[:3, 3] + frame[:3, :3] @ np.asarray(place))

    girdles = girdles or {side: np.zeros(3) for side in "rl"}
    width = (measured.hip_half_width - 0.0073) / 0.33  # `hip_joint_centre`, inverted
    x, _, z = -hip_joint_centre(width, PELVIC_DEPTH)
    shoulders = [at(f"upper_arm_{s}", np.zeros(3)) + girdles[s] for s in "rl"]
    # The acromion marker is above the shoulder joint by a share of the distance between the
    # shoulders.
    above = SURFACE.acromion_to_shoulder * np.linalg.norm(shoulders[1] - shoulders[0]) * UP
    points = {"Sacrum": at("pelvis", (x - PELVIC_DEPTH, 0.0, z))}
    skin = SURFACE.marker_offset
    for side, sign in (("R", -1.0), ("L", 1.0)):
        s = side.lower()
        out = np.array([0.0, sign, 0.0])
        mirror = np.array([1.0, -sign, 1.0])
        leg = measured.modelled["right" if s == "r" else "left"]
        girdle = girdles[s]
        points |= {
            f"{side}.ASIS": at("pelvis", (x, sign * width / 2, z)),
            f"{side}.PSIS": at("pelvis", (x - PELVIC_DEPTH, sign * 0.045, z)),
            f"{side}.Thigh": at(f"thigh_{s}", (0.0, sign * 0.085, -0.21)),
            f"{side}.Shank": at(f"shank_{s}", (0.0, sign * 0.06, -0.20)),
            # Markers lie on the skin, `SURFACE.marker_offset` outside the bone, on both sides of
            # the joint's axis.
            f"{side}.Knee": at(f"shank_{s}", (KNEE_WIDTH / 2 + skin) * out),
            f"{side}.Knee.Medial": at(f"shank_{s}", -(KNEE_WIDTH / 2 + skin) * out),
            f"{side}.Heel": at(f"foot_{s}", mirror * (leg.heel - [skin, 0.0, 0.0])),
            f"{side}.MT1": at(f"foot_{s}", mirror * leg.metatarsals[0]),
            f"{side}.MT5": at(f"foot_{s}", mirror * leg.metatarsals[1]),
            f"{side}.MT2": at(f"foot_{s}", mirror * second_head(leg)),
            f"{side}.Toe": at(f"toes_{s}", (0.05, 0.0, 0.03)),
            f"{side}.Acromion": at(f"upper_arm_{s}", np.zeros(3)) + girdle + above,
            f"{side}.Elbow": at(f"forearm_{s}", (ELBOW_WIDTH / 2 + skin) * out) + girdle,
            f"{side}.Elbow.Medial": at(f"forearm_{s}", -(ELBOW_WIDTH / 2 + skin) * out) + girdle,
        }
        if leg.forearm is not None:
            down = -leg.forearm
            points |= {
                f"{side}.Wrist{name}": at(f"forearm_{s}", (forward, 0.0, down)) + girdle
                for name, forward in (("", 0.0), (".Radial", 0.03), (".Ulnar", -0.03))
            }
        # The malleoli belong to the shank, so they do not turn with the foot's axes.
        shank = frames[SEGMENTS.index(f"shank_{s}"), :3, :3]
        ankle = at(f"foot_{s}", np.zeros(3))
        points[f"{side}.Ankle"] = ankle + shank @ ((ANKLE_WIDTH / 2 + skin) * out)
        points[f"{side}.Ankle.Medial"] = ankle - shank @ ((ANKLE_WIDTH / 2 + skin) * out)
    return points


def second_head(leg: Limbs) -> Array:
    """Where a foot of mean shape (`FOOT_SHAPE`) has the second metatarsal head, (3,) m in the
    foot's frame, by the heel and the first and fifth metatarsal heads of `leg`.
    """
    heel = leg.heel - [SURFACE.marker_offset, 0.0, 0.0]
    places, heights = [], []
    for name, head in zip(("MT1", "MT5"), leg.metatarsals, strict=True):
        ahead, medial, above = FOOT_SHAPE[name, "MT2"]
        # Seen from above as complex numbers: a quotient is a turn and a stretch, so `FOOT_SHAPE`
        # gives the head relative to the line from the heel to MT2. Both known heads say where MT2
        # is, and their mean is taken.
        place = complex(*(head - heel)[:2]) / complex(ahead, medial)
        places.append(place)
        heights.append(head[2] - above * abs(place))
    middle = sum(places) / 2.0
    return np.array([heel[0] + middle.real, heel[1] + middle.imag, np.mean(heights)])
