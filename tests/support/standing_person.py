"""A made-up person who stands: a body model in a known pose and the landmarks on it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
from standing_landmarks import (
    ANKLE_WIDTH,
    ELBOW_WIDTH,
    KNEE_WIDTH,
    PELVIC_DEPTH,
    UP,
    landmarks_on,
    standing_pose,
)

from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.scaling.foot_shape import FOOT_SHAPE
from gaitval.scaling.joint_centres import SURFACE, measure
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.scaling import build_body
from gaitval.subjects.subject_file import load_subject

__all__ = ["ANKLE_WIDTH", "ELBOW_WIDTH", "KNEE_WIDTH", "PELVIC_DEPTH"]

PERSON = SimpleNamespace(
    identifier="made-up", sex="F", age_years=None, mass_kg=61.0, height_m=1.66, markers={}
)
TILT = 11.0
"""Degrees, of the pelvis in standing."""
TOE_OUT = {"r": 7.0, "l": 4.0}
HEADING = 33.0
HEEL_TO_SECOND_HEAD, SECOND_HEAD_HEIGHT = 0.185, -0.045


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
            elif definition.landmark in (None, "R.Crest", "L.Crest"):
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
    heads = []
    for head, place in (("MT1", first), ("MT5", fifth)):
        ahead = place * straight * HEEL_TO_SECOND_HEAD
        up = SECOND_HEAD_HEIGHT + FOOT_SHAPE[head, "MT2"][2] * HEEL_TO_SECOND_HEAD
        heel = own.right.heel - [SURFACE.marker_offset, 0, 0]
        heads.append([heel[0] + ahead.real, heel[1] + ahead.imag, up])
    limbs = replace(own.right, metatarsals=np.array(heads), upper_arm=0.271, forearm=0.243)
    return replace(
        own,
        right=limbs,
        left=limbs,
        pelvic_tilt=np.radians(TILT),
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
    pose = standing_pose(
        model,
        measured.right.ankle_height,
        tilt=TILT,
        heading=HEADING,
        toe_out=toe_out,
        raised=raised,
    )
    frames = segment_frames(model, pose[None])[0]
    trunk = frames[SEGMENTS.index("torso"), :3, :3]
    girdle = {
        side: trunk @ [0.0, inwards, 0.0] + 0.04 * UP if raised > 45 else np.zeros(3)
        for side, inwards in (("r", 0.03), ("l", -0.03))
    }
    landmarks = landmarks_on(measured, frames, girdle)
    return StandingPerson(measured, model, pose, landmarks, frames, girdle)
