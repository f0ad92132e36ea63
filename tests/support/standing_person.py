"""A made-up person who stands: a body model in a known pose and the landmarks on it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from gaitval.coordinates import COORDINATES
from gaitval.datasets.subject_file import load_subject
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.scaling.joint_centres import (
    ACROMION_TO_SHOULDER,
    FOOT_SHAPE,
    MARKER_OFFSET,
    hip_joint_centre,
    measure,
)
from gaitval.scaling.marker_sets import MarkerSet
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.scaling import build_body

PERSON = SimpleNamespace(identifier="made-up", sex="F", mass_kg=61.0, height_m=1.66, markers={})
KNEE_WIDTH, ANKLE_WIDTH, ELBOW_WIDTH = 0.102, 0.068, 0.066
PELVIC_DEPTH = 0.19
ANGLES = {
    "pelvis_tilt": 11.0,
    "hip_flexion": 14.0,
    "knee_angle": 6.0,
    "ankle_angle": 3.0,  # soles level: hip - tilt - knee + ankle = 0
    "lumbar_extension": 11.0,  # trunk upright
    "arm_flex": 4.0,
    "arm_add": -9.0,
    "elbow_flex": 20.0,
}
"""Degrees, both sides."""
TOE_OUT = {"r": 7.0, "l": 4.0}
HEADING = 33.0
HEEL_TO_SECOND_HEAD = 0.185
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class StandingPerson:
    """A body, its pose (31,), and where its landmarks and some more markers are, (3,) m."""

    measured: Measurements
    model: BodyModel
    pose: np.ndarray
    landmarks: dict[str, np.ndarray]
    frames: np.ndarray
    girdle: dict[str, np.ndarray]

    def markers(self, marker_set: MarkerSet, seed: int = 0):
        """Places of the markers of a set, in the laboratory and in their segments, (3,) m."""
        noise = np.random.default_rng(seed)
        places, local = {}, {}
        for name, definition in marker_set.markers.items():
            frame = self.frames[SEGMENTS.index(definition.segment)].copy()
            if "arm" in definition.segment:
                frame[:3, 3] += self.girdle[definition.segment[-1]]
            if definition.landmark in self.landmarks:
                places[name] = self.landmarks[definition.landmark]
            elif definition.landmark is None:
                places[name] = frame[:3, 3] + frame[:3, :3] @ noise.uniform(-0.1, 0.1, 3)
            else:
                continue
            local[name] = (places[name] - frame[:3, 3]) @ frame[:3, :3]
        return places, local


def made_up_measurements() -> Measurements:
    """Those of subject 5 with arms, and equal legs whose feet have the mean shape."""
    own = measure(load_subject("S05").markers)
    first, fifth = (complex(*FOOT_SHAPE[head, "MT2"][:2]) for head in ("MT1", "MT5"))
    straight = np.conj(first + fifth) / abs(first + fifth)
    second = _second_head(own.right)
    heads = []
    for head, place in (("MT1", first), ("MT5", fifth)):
        ahead = place * straight * HEEL_TO_SECOND_HEAD
        up = second[2] + FOOT_SHAPE[head, "MT2"][2] * HEEL_TO_SECOND_HEAD
        heel = own.right.heel - [MARKER_OFFSET, 0, 0]
        heads.append([heel[0] + ahead.real, heel[1] + ahead.imag, up])
    leg = replace(own.right, metatarsals=np.array(heads))
    return replace(
        own,
        right=leg,
        left=leg,
        pelvic_tilt=np.radians(ANGLES["pelvis_tilt"]),
        upper_arm=(0.271, 0.271),
        forearm=(0.243, 0.243),
        shoulder_half_width=0.165,
        shoulder_height=0.47,
    )


def standing_person(
    *, raised: float = 0.0, toe_out: Mapping[str, float] = TOE_OUT
) -> StandingPerson:
    """Someone who stands with knees a little bent, toes out and arms hanging.

    Parameters
    ----------
    raised : degrees of arm abduction; the girdle goes up by 4 and in by 3 cm where above 45.
    toe_out : degrees, of each side. The hip turns the leg about the thigh, which leans by 3°: a
        foot turned by 7° stands 0.4° on its edge, and standing is where inversion is zero.
    """
    measured = made_up_measurements()
    model = build_body(PERSON, measured).model
    pose = np.zeros(31)
    for name, value in ANGLES.items():
        for coordinate in (name, f"{name}_r", f"{name}_l"):
            if coordinate in COORDINATES:
                pose[COORDINATES.index(coordinate)] = np.radians(value)
    for side, angle in toe_out.items():
        pose[COORDINATES.index(f"hip_rotation_{side}")] = -np.radians(angle)
        if raised:
            pose[COORDINATES.index(f"arm_add_{side}")] = -np.radians(raised)
    tilt, heading = np.radians(ANGLES["pelvis_tilt"]), np.radians(HEADING)
    cz, sz, cy, sy = np.cos(heading), np.sin(heading), np.cos(tilt), np.sin(tilt)
    turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    pose[:3] = _rotation_vector(turn)
    pose[3:6] = 0.4, -0.3, 0.0
    ankle = segment_frames(model, pose[None])[0, SEGMENTS.index("foot_r"), 2, 3]
    pose[5] = measured.right.ankle_height - ankle
    frames = segment_frames(model, pose[None])[0]
    trunk = frames[SEGMENTS.index("torso"), :3, :3]
    girdle = {
        side: trunk @ [0.0, inwards, 0.0] + 0.04 * UP if raised > 45 else np.zeros(3)
        for side, inwards in (("r", 0.03), ("l", -0.03))
    }
    landmarks = _landmarks(measured, frames, girdle)
    return StandingPerson(measured, model, pose, landmarks, frames, girdle)


def _rotation_vector(turn: np.ndarray) -> np.ndarray:
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    angle = np.arccos((np.trace(turn) - 1) / 2)
    return axis / np.linalg.norm(axis) * angle


def _landmarks(
    measured: Measurements, frames: np.ndarray, girdles: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    def at(segment, place):
        frame = frames[SEGMENTS.index(segment)]
        return frame[:3, 3] + frame[:3, :3] @ np.asarray(place)

    width = (measured.hip_half_width - 0.0073) / 0.33
    x, _, z = -hip_joint_centre(width, PELVIC_DEPTH)
    shoulders = [at(f"upper_arm_{s}", np.zeros(3)) + girdles[s] for s in "rl"]
    above = ACROMION_TO_SHOULDER * np.linalg.norm(shoulders[1] - shoulders[0]) * UP
    points = {"Sacrum": at("pelvis", [x - PELVIC_DEPTH, 0, z])}
    for side, sign in (("R", -1.0), ("L", 1.0)):
        s = side.lower()
        out = np.array([0.0, sign, 0.0])
        mirror = np.array([1.0, -sign, 1.0])
        leg = measured.right
        girdle = girdles[s]
        skin = MARKER_OFFSET
        points |= {
            f"{side}.ASIS": at("pelvis", [x, sign * width / 2, z]),
            f"{side}.PSIS": at("pelvis", [x - PELVIC_DEPTH, sign * 0.045, z]),
            f"{side}.Thigh": at(f"thigh_{s}", [0, sign * 0.085, -0.21]),
            f"{side}.Shank": at(f"shank_{s}", [0, sign * 0.06, -0.20]),
            f"{side}.Knee": at(f"shank_{s}", (KNEE_WIDTH / 2 + skin) * out),
            f"{side}.Knee.Medial": at(f"shank_{s}", -(KNEE_WIDTH / 2 + skin) * out),
            f"{side}.Heel": at(f"foot_{s}", mirror * (leg.heel - [skin, 0, 0])),
            f"{side}.MT1": at(f"foot_{s}", mirror * leg.metatarsals[0]),
            f"{side}.MT5": at(f"foot_{s}", mirror * leg.metatarsals[1]),
            f"{side}.MT2": at(f"foot_{s}", mirror * _second_head(leg)),
            f"{side}.Toe": at(f"toes_{s}", [0.05, 0.0, 0.03]),
            f"{side}.Acromion": at(f"upper_arm_{s}", np.zeros(3)) + girdle + above,
            f"{side}.Elbow": at(f"forearm_{s}", (ELBOW_WIDTH / 2 + skin) * out) + girdle,
            f"{side}.Elbow.Medial": at(f"forearm_{s}", -(ELBOW_WIDTH / 2 + skin) * out) + girdle,
            f"{side}.Wrist": at(f"forearm_{s}", [0, 0, -measured.forearm[0]]) + girdle,
            f"{side}.Wrist.Radial": at(f"forearm_{s}", [0.03, 0, -measured.forearm[0]]) + girdle,
            f"{side}.Wrist.Ulnar": at(f"forearm_{s}", [-0.03, 0, -measured.forearm[0]]) + girdle,
        }
        shank = frames[SEGMENTS.index(f"shank_{s}"), :3, :3]
        ankle = at(f"foot_{s}", np.zeros(3))
        points[f"{side}.Ankle"] = ankle + shank @ ((ANKLE_WIDTH / 2 + skin) * out)
        points[f"{side}.Ankle.Medial"] = ankle - shank @ ((ANKLE_WIDTH / 2 + skin) * out)
    return points


def _second_head(leg) -> np.ndarray:
    """Where the mean foot has the second metatarsal head, in the foot's frame, (3,) m."""
    first, fifth = (complex(*FOOT_SHAPE[head, "MT2"][:2]) for head in ("MT1", "MT5"))
    ahead = np.conj(first + fifth) / abs(first + fifth) * HEEL_TO_SECOND_HEAD
    heel = leg.heel - [MARKER_OFFSET, 0, 0]
    return np.array([heel[0] + ahead.real, heel[1] + ahead.imag, -0.045])
