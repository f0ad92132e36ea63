"""A standing pose that is not the whole trial as recorded: a part of it, on another floor, with
level feet, or put together from the walk.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError, count_of
from gaitval.gait.cycles import stances
from gaitval.gait.events import marker_events
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.joint_centres import pelvis_frame
from gaitval.scaling.landmarks import middle_psis
from gaitval.scaling.marker_set import MarkerSet

MID_STANCE: Final = (0.35, 0.55)
"""Fraction of stance in which the foot is flat, the leg upright and the pelvis nearly level."""
ANKLE_ASIDE: Final = 0.035
"""m, distance of the marker on the lateral malleolus from the ankle's centre: half an ankle's width
of 7 cm. In standing the ankle is put below the hip."""
LEG: Final = ("thigh", "shank", "foot", "toes")
PELVIS: Final = ("R.ASIS", "L.ASIS", "R.PSIS", "L.PSIS", "Sacrum")
FEET: Final = ("Heel", "MT1", "MT2", "MT5", "Toe")
"""Landmarks of a foot that turn when it is levelled about its ankle."""
LENGTHS_OF_WALK: Final = 0.012
"""m, largest difference of thigh and shank between a standing pose put together from the walk and
the standing trial of the same person: five people of WBDS01, biomechZoo and BTKData, of which one
person's hip angles differed by 5 degrees and the others' by 2 at most."""


def of_walk(poses: int) -> QualityFlag:
    """What a user should know who gives no standing trial: the pose is of so many `poses`."""
    return QualityFlag(
        *("standing pose", "standing", float(poses), 1.0, "poses"),
        f"no standing trial: the pose is put together of {count_of(poses, 'pair')} of mid-stances "
        f"of the walk. Lengths are up to {1000 * LENGTHS_OF_WALK:.0f} mm and the zero of angles up "
        "to 7° off what a standing trial gives; give one with --static if there is one",
    )


def on_floor(recording: Recording, height: float) -> Recording:
    """A `recording` in the project's axes as if the floor were at z = 0 and not at `height`, m."""
    return replace(recording, markers=recording.markers - [0.0, 0.0, height])


def with_level_feet(recording: Recording, landmarks: Mapping[str, str]) -> Recording:
    """A standing trial `recording` of a person on the toes or heels, with the feet put flat.

    `landmarks` names the markers of the feet. Each foot turns about its lateral ankle marker, about
    the person's left-right axis, until heel and forefoot are at one height: the markers of both are
    as high above the sole, as Plug-in Gait assumes for feet that are not flat. The ankles stay as
    high as they are; who stands on the toes says with `on_floor` by how much that is more than with
    flat feet.
    """
    markers = recording.markers.copy()
    for side in "RL":
        names = {part: landmarks.get(f"{side}.{part}") for part in (*FEET, "Ankle")}
        seen = {part: name for part, name in names.items() if name in recording.names}
        heads = [name for part, name in seen.items() if part.startswith("MT")]
        if not {"Heel", "Ankle"} <= seen.keys() or not heads:
            continue
        columns = {part: recording.names.index(str(name)) for part, name in seen.items()}
        ankle = recording.markers[:, columns["Ankle"]]
        heel = recording.markers[:, columns["Heel"]]
        front = np.nanmean(
            [recording.markers[:, recording.names.index(str(name))] for name in heads], axis=0
        )
        slope = np.arctan2(front[:, 2] - heel[:, 2], np.hypot(*(front - heel)[:, :2].T))
        # Horizontal and perpendicular to the foot, to its left: a positive turn lowers the
        # forefoot.
        across = np.cross([0.0, 0.0, 1.0], front - heel)
        across /= np.linalg.norm(across, axis=1)[:, None]
        known = np.isfinite(slope)
        turn = Rotation.from_rotvec(np.where(known, slope, 0.0)[:, None] * np.nan_to_num(across))
        for part in FEET:
            if part in columns:
                arm = recording.markers[:, columns[part]] - ankle
                markers[:, columns[part]] = ankle + turn.apply(np.nan_to_num(arm))
                markers[~np.isfinite(arm).all(axis=1), columns[part]] = np.nan
    return replace(recording, markers=markers)


def standing_in_walk(recording: Recording, marker_set: MarkerSet) -> Recording:
    """A standing pose put together from the mid-stances of a walking trial.

    At mid-stance the leg is nearly straight and its foot flat. Each frame of the result is one
    right and one left mid-stance: moved and turned so that their pelvises agree (each by half of
    what is between them), each leg turned about its hip in the frontal plane until it is vertical
    (walking people put their feet in one line) with its foot kept flat, and both at the mean height
    of the stance feet. Trunk and arms are half way between the two: each leans the other way.

    `recording` is cleaned, in the project's axes, walking along +x, with markers of `marker_set`.
    Raises RecordError if no mid-stance of a foot shows the pelvis and that leg.
    """
    landmarks = marker_set.landmarks
    middles = {side: _mid_stances(recording, landmarks, side) for side in SIDES}
    poses = [
        pose
        for frames in zip(middles["right"], middles["left"], strict=False)
        if (pose := _together(recording, marker_set, frames)) is not None
    ]
    if not poses:
        raise RecordError(
            f"{recording.source}: no mid-stance of both feet shows pelvis and leg, so no standing "
            "pose can be put together from the walk. Give a standing trial as --static."
        )
    return replace(recording, markers=np.array(poses), plates=(), force_rate=0.0, events=())


def _mid_stances(recording: Recording, landmarks: Mapping[str, str], side: Side) -> list[int]:
    """The frame in `MID_STANCE` of each whole stance of a foot in which its heel is lowest; of a
    walk that is too short to have one, those in which the ankle falls behind the pelvis.
    """
    heel, ankle = (landmarks[f"{side[0].upper()}.{part}"] for part in ("Heel", "Ankle"))
    height, frames = recording.marker(heel)[:, 2], list[int]()
    for of, strike, off in stances(marker_events(recording, landmarks=landmarks)):
        if of == side:
            times = strike + np.array(MID_STANCE) * (off - strike)
            first, last = np.searchsorted(recording.time, times)
            frames.append(int(first) + int(np.nanargmin([*height[first:last], np.inf])))
    if frames:
        return frames
    parts = {landmarks.get(name) for name in PELVIS} & {*recording.names}
    pelvis = np.mean([recording.marker(str(name))[:, 0] for name in parts], axis=0)
    behind = recording.marker(ankle)[:, 0] < pelvis
    return [int(i) for i in np.flatnonzero(behind[1:] & ~behind[:-1])]


def _together(recording: Recording, marker_set: MarkerSet, frames: tuple[int, int]) -> Array | None:
    """Markers (M, 3) of a right and a left mid-stance as one pose; None if parts are hidden."""
    segments = np.array([marker_set.markers[name].segment for name in recording.names])
    poses = [recording.markers[frame].copy() for frame in frames]
    seen = np.asarray(np.isfinite(poses).all(axis=(0, 2)))
    pelvis = np.flatnonzero(seen & (segments == "pelvis"))
    ankles = [
        recording.names.index(name)
        for side in "RL"
        if (name := marker_set.landmarks.get(f"{side}.Ankle")) in recording.names
    ]
    there = marker_set.on_landmarks(dict(zip(recording.names, seen, strict=True)))
    spines = all(there.get(f"{side}.ASIS") for side in "RL") and (
        there.get("Sacrum") or all(there.get(f"{side}.PSIS") for side in "RL")
    )
    if not spines or len(pelvis) < 3 or len(ankles) < 2 or not seen[ankles].all():
        return None
    heights = [pose[ankle, 2] for pose, ankle in zip(poses, ankles, strict=True)]
    centres = [pose[pelvis].mean(axis=0) for pose in poses]
    apart, _ = Rotation.align_vectors(poses[0][pelvis] - centres[0], poses[1][pelvis] - centres[1])
    right, left = (
        (pose - centre) @ Rotation.from_rotvec(share * apart.as_rotvec()).as_matrix().T
        for pose, centre, share in zip(poses, centres, (-0.5, 0.5), strict=True)
    )
    whole = np.mean([right, left], axis=0)
    for pose, side in ((right, "r"), (left, "l")):
        legs = np.isin(segments, [f"{name}_{side}" for name in LEG])
        whole[legs] = pose[legs]
    for side, ankle in zip(SIDES, ankles, strict=True):
        _set_upright(whole, segments, marker_set, recording.names, side, ankle)
    whole[:, 2] += np.mean(heights) - np.mean(whole[ankles, 2])
    return np.asarray(whole)


def _set_upright(
    pose: Array,
    segments: NDArray[np.str_],
    marker_set: MarkerSet,
    names: Sequence[str],
    side: Side,
    ankle: int,
) -> None:
    """Turn a leg about its hip in the frontal plane until it is vertical, in place; the foot moves
    with the ankle and does not turn.
    """
    points = marker_set.on_landmarks(dict(zip(names, pose, strict=True)))
    middle = (points["R.ASIS"] + points["L.ASIS"]) / 2
    rear = middle_psis(points)
    width = float(np.linalg.norm(points["R.ASIS"] - points["L.ASIS"]))
    local = hip_joint_centre(width, float(np.linalg.norm(middle - rear)))
    if side == "left":
        local[1] = -local[1]
    hip = middle + pelvis_frame(points["R.ASIS"], points["L.ASIS"], rear) @ local
    outwards = ANKLE_ASIDE if side == "left" else -ANKLE_ASIDE
    arm = pose[ankle] - hip
    # Angle from the vertical at which the ankle is `ANKLE_ASIDE` lateral of the hip.
    wanted = np.arcsin(np.clip(outwards / np.hypot(arm[1], arm[2]), -1.0, 1.0))
    turn = Rotation.from_rotvec([wanted - np.arctan2(arm[1], -arm[2]), 0.0, 0.0])
    before = pose[ankle].copy()
    leg = np.isin(segments, [f"{name}_{side[0]}" for name in ("thigh", "shank")])
    foot = np.isin(segments, [f"{name}_{side[0]}" for name in ("foot", "toes")])
    pose[leg] = hip + turn.apply(pose[leg] - hip)
    pose[foot] += hip + turn.apply(before - hip) - before
