"""Markers beside their landmarks, and a standing pose unlike the walk, by the walk itself.

- One knee: a marker behind the knee's axis comes nearer to the ankle as the knee bends, makes that
  knee look straighter in standing, and is moved forward by the fit to the walk. Skin does the first
  to both knees, people stand with knees bent unlike, and each of the three alone is as large in
  sound recordings; their sum, right less left, is not.
- Any marker that was moved between the trials: the body is fitted to both, so it is beside its
  place all through the walk, by a quarter to a half of what it was moved by. Skin does the same on
  both sides, so right less left is looked at.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.quality_flags import QualityFlag
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.session.trial import WalkingTrial

if TYPE_CHECKING:
    from gaitval.scaling.landmarks import Place
    from gaitval.session.scale import FittedBody


KNEE: Final = 0.0033
"""m, SD of the sum of what shows one knee's marker too far forward, right less left, of 13 people
(children of McGill; adults of Stanford, Luxembourg, WBDS and other samples)."""
BEYOND: Final = 3.0
"""SD that nobody who is sound is beyond."""
KNEE_BY: Final[Mapping[str, float]] = {"nearer": 0.47, "fitted": 1.6, "straighter": 0.062}
"""m too far forward, for each m by which the distance to the ankle grows more with the sine of the
flexion, for each m that the fit to the walk moves the marker forward, and for each rad that the
knee is bent more in standing: what finds 18 mm best in thirteen people."""
HALF_SEEN: Final = 0.7
"""Of that sum where a medial marker holds the joint's centre half as far back."""
LEAST_SHARE: Final = 0.25
"""Of that sum, what the walk itself shows at least of a misplaced marker: 0.36 to 1.0 of 18 mm in
four people. Who stands with one knee more bent, as after a stroke, has less."""
STANDS: Final[Mapping[str, float]] = {
    "knees": float(np.radians(10.0)), "knee": float(np.radians(13.0)),
    "foot": float(np.radians(20.0)),
}  # fmt: skip
"""rad, by which both knees or one may be bent more in standing than where the walk stretches them
most (at most 6.6 and 7.6 degrees of 17 people), and by which one foot more than the other may be
turned out (at most 17)."""
MOVED: Final[Mapping[str, tuple[float, float, float]]] = {
    "ASIS": (0.0020, 0.0020, 0.0022),
    "Knee": (0.0040, 0.0065, 0.0040),
    "Ankle": (0.0025, 0.0035, 0.0035),
    "Heel": (0.0020, 0.0040, 0.0035),
    "MT1": (0.0045, 0.0045, 0.0040),
    "MT2": (0.0040, 0.0045, 0.0040),
    "MT5": (0.0040, 0.0045, 0.0040),
    "Toe": (0.0040, 0.0045, 0.0040),
}
"""m, forward, outward and up on the segment, by which right and left may differ. Of 18 recordings
of 18 people (nine of McGill, four of Stanford, others of Brazil and Plug-in Gait's samples) at
most 0.8, 0.7, 1.1 (ASIS), 2.0, 3.6, 1.6 (knee), 0.7, 1.5, 1.6 (ankle), 0.6, 1.9, 1.5 (heel) and
2.4, 2.2, 2.0 mm (forefoot)."""
KNOWN_BY: Final = frozenset((
    "displaced marker", "height of a foot's marker",
    "lost marker", "filled gap", "loose marker",
))  # fmt: skip
"""Checks of warnings about what puts a marker beside its place too, or says so better."""
LEAST_FLEXION: Final = float(np.radians(30.0))
LEAST_FRAMES: Final = 20
FLAT: Final = 0.25
"""m/s of the ankle, below which a foot lies flat."""
WAYS: Final = (("forward", "back"), ("outward", "inward"), ("up", "down"))


class Off(NamedTuple):
    """How far markers are off, and the SD of that in sound people, m."""

    value: float
    sound: float

    @property
    def limit(self) -> float:
        """m."""
        return BEYOND * self.sound

    @property
    def told(self) -> bool:
        """Whether that is more than anybody sound has."""
        return abs(self.value) > self.limit


def knee_forward(
    body: "FittedBody",
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
    points: "Mapping[str, Place]",
) -> Off | None:
    """How much too far forward the right knee's marker lies beside the left one's, by all `walks`;
    `landmarks` names the landmarks' markers, `points` are those on landmarks in standing. None
    where knees and ankles have no markers in the walks, do not bend, or where little but how the
    person stands says so.
    """
    knees = [landmarks.get(f"{side}.Knee", "") for side in "RL"]
    fitted = {marker.name: marker.position[0] for marker in body.markers}
    placed = {marker.name: marker.position[0] for marker in body.placement.markers}
    grows = [_parting(walks, landmarks, side) for side in "RL"]
    if grows[0] is None or grows[1] is None or not {*knees} <= fitted.keys() & placed.keys():
        return None
    moved = np.subtract(*(fitted[name] - placed[name] for name in knees))
    bent = np.subtract(
        *(body.placement.standing[COORDINATES.index(f"knee_angle_{side}")] for side in "rl")
    )
    in_walk = float(KNEE_BY["nearer"] * (grows[0] - grows[1]) + KNEE_BY["fitted"] * moved)
    forward = in_walk + float(KNEE_BY["straighter"] * bent)
    if abs(in_walk) < LEAST_SHARE * abs(forward) or in_walk * forward < 0.0:
        return None
    seen = HALF_SEEN if any(f"{side}.Knee.Medial" in points for side in "RL") else 1.0
    return Off(forward / seen, KNEE / seen)


def knee_warnings(off: Off | None, landmarks: Mapping[str, str]) -> Iterator[QualityFlag]:
    """Warning about a knee's marker beside the axis that the walk shows: one at most."""
    if off is None or not off.told:
        return
    right, left = (landmarks[f"{side}.Knee"] for side in "RL")
    back, forward = (right, left) if off.value < 0.0 else (left, right)
    size = abs(off.value)
    yield QualityFlag(
        "place of a knee's marker", f"{right} and {left}", size, off.limit, "m",
        f"by how the knees turn in the walk, {back} is some {1000 * size:.0f} mm too far back, or "
        f"{forward} too far forward (sound pairs are within {1000 * off.limit:.0f} mm of each "
        "other): one of them, or the ankle's below it the other way, is misplaced in all trials "
        "alike or was moved between standing and walk, and the leg's angles are off by some "
        "degrees. Put both on the axis that the knee bends about, and record standing and walk "
        "with the markers untouched",
    )  # fmt: skip


def moved_warnings(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
) -> Iterator[QualityFlag]:
    """A warning about the landmark whose markers are most beside their places in a walk, on one
    side more than on the other: one at most. `markers` are on the `model`; `landmarks` names the
    landmarks' markers.
    """
    placed = {marker.name: marker for marker in markers}
    worst: tuple[float, str, str, int, float] | None = None
    for walk in walks:
        frames = segment_frames(model, walk.kinematics.positions)
        for landmark, limits in MOVED.items():
            pair = [placed.get(landmarks.get(f"{side}.{landmark}", "")) for side in "RL"]
            away = [None if one is None else _beside(frames, one, walk) for one in pair]
            if away[0] is None or away[1] is None:
                continue
            # outward is to the right on the right side
            apart = away[0] * [1.0, -1.0, 1.0] - away[1]
            axis = int(np.argmax(np.abs(apart) / limits))
            share = float(abs(apart[axis]) / limits[axis])
            if share > 1.0 and (worst is None or share > worst[0]):
                worst = share, walk.name, landmark, axis, float(apart[axis])
    if worst is None:
        return
    _, name, landmark, axis, size = worst
    names = [landmarks[f"{side}.{landmark}"] for side in "RL"]
    limit = MOVED[landmark][axis]
    yield QualityFlag(
        "place of a marker", " and ".join(names), abs(size), limit, "m",
        f"in {name}, {names[0]} is {1000 * abs(size):.1f} mm farther {WAYS[axis][size < 0.0]} "
        f"beside its place on the body, which fits standing and walk, than {names[1]} (elsewhere "
        f"within {1000 * limit:.1f} mm): one of them was moved between the trials, by two to four "
        "times as much, or another marker of its segment was. Angles of that leg, or of the "
        "pelvis, are some degrees off. Record both with the markers untouched",
    )  # fmt: skip


def standing_warnings(
    model: BodyModel, standing: Array, walks: Sequence[WalkingTrial]
) -> Iterator[QualityFlag]:
    """Warnings about a `standing` pose, (n,) coordinates, in which knees are bent that the walk
    stretches, or one foot is turned that it is not.
    """
    bent = []
    for side in "rl":
        at = COORDINATES.index(f"knee_angle_{side}")
        known = [walk.kinematics.positions[walk.kinematics.converged, at] for walk in walks]
        angles = np.concatenate(known)
        if len(angles) < LEAST_FRAMES or np.ptp(angles) < LEAST_FLEXION:
            break
        bent.append((float(standing[at]), float(np.percentile(angles, 2.0))))
    if len(bent) == len(SIDES):
        stood, walked = np.mean(bent, axis=0)
        more, one = max((stand - walk, stand) for stand, walk in bent)
        if stood - walked <= STANDS["knees"] and more > STANDS["knee"]:
            stood, walked = one, one - more
        if stood - walked > STANDS["knees"]:
            yield QualityFlag(
                "standing pose", "knees in standing", float(np.degrees(stood - walked)),
                float(np.degrees(STANDS["knees"])), "deg",
                f"they are, or one is, bent by {np.degrees(stood):.0f}° in standing, and by "
                f"{np.degrees(walked):.0f}° only where the walk stretches it: the person did not "
                "stand upright. Lengths are up to a centimetre, and the zero of angles some "
                "degrees off. Record standing again with straight knees, or leave --static out",
            )  # fmt: skip
    turned = _turned(model, standing, walks)
    if turned is not None and abs(turned) > STANDS["foot"]:
        yield QualityFlag(
            "standing pose", "feet in standing", float(np.degrees(abs(turned))),
            float(np.degrees(STANDS["foot"])), "deg",
            f"in standing the {'right' if turned > 0.0 else 'left'} foot is turned out by "
            f"{np.degrees(abs(turned)):.0f}° more, beside the other, than in the walk: the zero of "
            "its hip's rotation and of its subtalar angle are some degrees off. Record standing "
            "with both feet as in walking",
        )  # fmt: skip


def _parting(
    walks: Sequence[WalkingTrial], landmarks: Mapping[str, str], side: str
) -> float | None:
    """m, by which the distance from the knee's to the ankle's marker grows with the sine of the
    knee's flexion; None where they are not seen, or the knee does not bend.
    """
    names = [landmarks.get(f"{side}.{joint}", "") for joint in ("Knee", "Ankle")]
    angles, parted = list[Array](), list[Array]()
    for walk in walks:
        if not all(name in walk.recording.names for name in names):
            return None
        knee, ankle = (walk.recording.marker(name) for name in names)
        apart: Array = np.linalg.norm(knee - ankle, axis=1)
        seen = np.isfinite(apart) & walk.kinematics.converged
        at = COORDINATES.index(f"knee_angle_{side.lower()}")
        angles.append(np.abs(walk.kinematics.positions[seen, at]))
        parted.append(apart[seen])
    angle = np.concatenate(angles) if angles else np.empty(0)
    if len(angle) < LEAST_FRAMES or np.ptp(angle) < LEAST_FLEXION:
        return None
    columns = np.column_stack([np.sin(angle), np.ones(len(angle))])
    return float(np.linalg.lstsq(columns, np.concatenate(parted), rcond=None)[0][0])


def _turned(model: BodyModel, standing: Array, walks: Sequence[WalkingTrial]) -> float | None:
    """rad, by which the right foot less the left one is turned out more in standing than while it
    lies flat in the walks; None where one of them never does.
    """
    feet = [SEGMENTS.index(f"foot_{side}") for side in "rl"]
    out = np.array([-1.0, -1.0])  # the left foot's angle is positive outwards
    pose = segment_frames(model, standing[None])[0]
    pelvis, *angles_stood = np.arctan2(pose[:, 1, 0], pose[:, 0, 0])[
        [SEGMENTS.index("pelvis"), *feet]
    ]
    stood = out @ np.array(angles_stood)
    walked: list[list[Array]] = [[], []]
    for walk in walks:
        frames = segment_frames(model, walk.kinematics.positions)[:, feet]
        step = np.gradient(frames[..., :3, 3], 1.0 / walk.recording.marker_rate, axis=0)
        step[..., 0] += walk.belt
        speed = np.linalg.norm(step, axis=2)
        for i, angles in enumerate(walked):
            flat = (speed[:, i] < FLAT) & walk.kinematics.converged
            angles.append(np.arctan2(frames[flat, i, 1, 0], frames[flat, i, 0, 0]))
    known = [np.concatenate(angles) if angles else np.empty(0) for angles in walked]
    if any(len(angles) < LEAST_FRAMES for angles in known):
        return None
    walking = out @ [np.median(angles) for angles in known]
    # Who stands aslant turns both feet with the pelvis, which has errors of its own.
    beside_axis, beside_pelvis = stood - walking, stood - pelvis * out.sum() - walking
    if beside_axis * beside_pelvis <= 0.0:
        return 0.0
    return float(min(beside_axis, beside_pelvis, key=abs))


def _beside(frames: Array, marker: ModelMarker, walk: WalkingTrial) -> Array | None:
    """(3,) m on its segment, mean over a walk of where a marker is beside its place; None where it
    is hardly seen.
    """
    if marker.name not in walk.recording.names:
        return None
    segment = frames[:, SEGMENTS.index(marker.segment)]
    from_origin = walk.recording.marker(marker.name) - segment[:, :3, 3]
    beside = np.einsum("tij,ti->tj", segment[:, :3, :3], from_origin) - marker.position
    known = np.isfinite(beside).all(axis=1) & walk.kinematics.converged
    if known.sum() < LEAST_FRAMES:
        return None
    return np.asarray(beside[known].mean(axis=0))
