"""Markers beside their landmarks, and a standing pose unlike the walk, by the walk itself.

- One knee: a marker behind the knee's axis comes nearer to the ankle as the knee bends, makes that
  knee look straighter in standing, and is moved forward by the fit to the walk. Skin does the first
  to both knees, people stand with knees bent unlike, and each of the three alone is as large in
  sound recordings; their sum, right less left, is not.
- Both knees: markers that are too low come nearer to the ankle by the share 1 - cos of the flexion.
  Skin does so too, in everybody by about as much; people's knees are about as high below the front
  spines.
- Both front spines: the pelvis looks tilted, and its regression puts the hips too far back, which
  the joint fit brings forward again to where the thighs turn.
- Any marker that was moved between the trials: the body is fitted to both, so it is beside its
  place all through the walk, by a quarter to a half of what it was moved by. Skin does the same on
  both sides, so right less left is looked at.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
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


class Sound(NamedTuple):
    """Mean and SD of sound people."""

    mean: float
    sd: float


PEOPLE: Final[Mapping[str, Sound]] = {
    "knee": Sound(0.0, 0.0033),
    "nearer": Sound(-0.0316, 0.0095),
    "knee share": Sound(0.512, 0.0165),
    "knees": Sound(0.0, 0.0070),
    "forward": Sound(0.0013, 0.0029),
    "tilt": Sound(float(np.radians(10.5)), float(np.radians(7.5))),
    "spines": Sound(0.0, 0.012),
    "leg": Sound(0.008, 0.011),
}
"""Of 13 to 20 people (children of McGill; adults of Stanford, Luxembourg, WBDS and other samples):
the sum of what shows one knee's marker too far forward, right less left (m); by how much the knee's
and the ankle's marker part for each 1 - cos of the flexion (m); height of the knees' markers over
that of the front spines; what both say together of the knees (m); by how much the joint fit moves
the hips forward from Harrington's regression (m); tilt of the plane of the spines in standing
(rad); what both say together of the spines (m); by how much a leg measured with a tape is longer
than from spine to malleolus (m)."""
BEYOND: Final = 3.0
"""SD that nobody who is sound is beyond."""
UNTAPED: Final = 4.0
"""The same of the front spines where no leg was measured with a tape: hips and tilt alone differ
more in children with cerebral palsy (3.4 SD in one of two)."""
FORWARD_BY: Final = 0.25
"""Of what both spines are too low by, how far the fit moves the hips: 0.21 to 0.27 in five people.
"""
KNEE_BY: Final[Mapping[str, float]] = {"nearer": 0.47, "fitted": 1.6, "straighter": 0.062}
"""m too far forward, for each m by which the distance to the ankle grows more with the sine of the
flexion, for each m that the fit to the walk moves the marker forward, and for each rad that the
knee is bent more in standing: what finds 18 mm best in thirteen people."""
HALF_SEEN: Final = 0.7
"""Of that sum where a medial marker holds the joint's centre half as far back."""
LEAST_SHARE: Final = 0.25
"""Of that sum, what the walk itself shows at least of a misplaced marker: 0.36 to 1.0 of 18 mm in
four people. Who stands with one knee more bent, as after a stroke, has less."""
SKINLESS: Final = 0.001
"""m, left of the distance from knee to ankle beside the flexion, below which no skin was between
markers and bones: 2 to 6 mm in people, 0 in simulated markers."""
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
    "displaced marker", "height of a foot's marker", "twist of the pelvis", "level of the pelvis",
    "lost marker", "straight line", "filled gap", "loose marker", "noise", "scale of the trials",
    "place of a knee's marker", "stuck coordinate",
))  # fmt: skip
"""Checks of warnings about what puts a marker beside its place too, or says so better."""
FRONT: Final = ("R.ASIS", "L.ASIS")
REAR: Final = ("R.PSIS", "L.PSIS", "Sacrum")
LEAST_FLEXION: Final = float(np.radians(30.0))
LEAST_FRAMES: Final = 20
FLAT: Final = 0.25
"""m/s of the ankle, below which a foot lies flat."""
WAYS: Final = (("forward", "back"), ("outward", "inward"), ("up", "down"))


class Off(NamedTuple):
    """How far markers are off, and the SD of that in sound people, m, of which a warning needs as
    many as `beyond`.
    """

    value: float
    sound: float
    beyond: float = BEYOND

    @property
    def limit(self) -> float:
        """m."""
        return self.beyond * self.sound

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
    grows = [_parting(walks, landmarks, side, _by_sine) for side in "RL"]
    if grows[0] is None or grows[1] is None or not {*knees} <= fitted.keys() & placed.keys():
        return None
    moved = np.subtract(*(fitted[name] - placed[name] for name in knees))
    bent = np.subtract(
        *(body.placement.standing[COORDINATES.index(f"knee_angle_{side}")] for side in "rl")
    )
    in_walk = float(KNEE_BY["nearer"] * (grows[0][0] - grows[1][0]) + KNEE_BY["fitted"] * moved)
    forward = in_walk + float(KNEE_BY["straighter"] * bent)
    if abs(in_walk) < LEAST_SHARE * abs(forward) or in_walk * forward < 0.0:
        return None
    seen = HALF_SEEN if any(f"{side}.Knee.Medial" in points for side in "RL") else 1.0
    return Off(forward / seen, PEOPLE["knee"].sd / seen)


def low_knees(
    walks: Sequence[WalkingTrial], landmarks: Mapping[str, str], points: "Mapping[str, Place]"
) -> Off | None:
    """How much both knees' markers are too low; None where the walks do not show both knees' and
    ankles' markers.
    """
    nearer = [_parting(walks, landmarks, side, _by_sine_and_cosine) for side in "RL"]
    names = [f"{side}.{name}" for side in "RL" for name in ("Knee", "ASIS")]
    if nearer[0] is None or nearer[1] is None or any(name not in points for name in names):
        return None
    if min(nearer[0][-1], nearer[1][-1]) <= SKINLESS:
        return None
    knees, spines = (
        float(np.mean([points[f"{side}.{name}"][2] for side in "RL"])) for name in ("Knee", "ASIS")
    )
    share, walked = PEOPLE["knee share"], PEOPLE["nearer"]
    by_walk = Off(0.5 * (nearer[0][1] + nearer[1][1]) - walked.mean, walked.sd)
    by_build = Off(share.mean * spines - knees, share.sd * spines)
    return _together(by_walk, by_build)._replace(sound=PEOPLE["knees"].sd)


def low_spines(
    body: "FittedBody", points: "Mapping[str, Place]", taped: Sequence[float | None] = ()
) -> Off | None:
    """How much both front spines' markers are too low, by the joint fit of the `body`, its tilt in
    standing, and the lengths of the legs, right and left, if they were `taped` (m). None where the
    fit moves no hips.
    """
    forward = body.chosen.hip_forward
    rear = [np.asarray(points[name]) for name in REAR if name in points]
    if forward is None or not rear or any(name not in points for name in FRONT):
        return None
    front = np.mean([np.asarray(points[name]) for name in FRONT], axis=0)
    depth = float(np.linalg.norm(front - np.mean(rear, axis=0)))
    tilt, fit, both, leg = (PEOPLE[name] for name in ("tilt", "forward", "spines", "leg"))
    by_tilt = Off(depth * (body.chosen.pelvic_tilt - tilt.mean), depth * tilt.sd)
    if by_tilt.told:  # the fit moves hips by 8 mm at most, and a tape says nothing of rear spines
        return by_tilt
    by_hips = Off((forward - fit.mean) / FORWARD_BY, fit.sd / FORWARD_BY)
    found = _together(by_hips, by_tilt)._replace(sound=both.sd)
    longer = [
        length - float(np.linalg.norm(np.subtract(points[f"{side}.ASIS"], points[f"{side}.Ankle"])))
        for side, length in zip("RL", taped, strict=False)
        if length is not None and f"{side}.Ankle" in points
    ]
    by_tape = Off(float(np.mean(longer)) - leg.mean, leg.sd) if longer else None
    # another's legs, or measured otherwise
    if by_tape is None or abs(by_tape.value - found.value) > BEYOND * np.hypot(both.sd, leg.sd):
        return found._replace(beyond=UNTAPED)
    return _together(found, by_tape)


def _together(one: Off, other: Off) -> Off:
    """The mean of two with the weights of their variances."""
    weights = np.array([one.sound**-2, other.sound**-2])
    value = float(weights @ [one.value, other.value] / weights.sum())
    return Off(value, float(weights.sum() ** -0.5))


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


def low_knees_warnings(off: Off | None, landmarks: Mapping[str, str]) -> Iterator[QualityFlag]:
    """Warning about both knees' markers: one at most."""
    if off is None or not off.told:
        return
    yield QualityFlag(
        "height of the knees' markers", " and ".join(landmarks[f"{side}.Knee"] for side in "RL"),
        abs(off.value), off.limit, "m",
        f"by how the knees turn in the walk, and by where knees are below the front spines, both "
        f"are some {1000 * abs(off.value):.0f} mm too {'low' if off.value > 0.0 else 'high'} "
        f"(sound people are within {1000 * off.limit:.0f} mm): thighs and shanks have "
        "wrong lengths, and hips and knees bend by some degrees too much or too little. Put them "
        "on the epicondyles, where the knee turns, in all trials",
    )  # fmt: skip


def low_spines_warnings(
    off: Off | None, landmarks: Mapping[str, str], tilt: float
) -> Iterator[QualityFlag]:
    """Warning about the front spines' markers of a pelvis that is tilted by `tilt` (rad) in
    standing: one at most.
    """
    if off is None or not off.told:
        return
    low, usual = off.value > 0.0, PEOPLE["tilt"]
    shown = (
        "more than anybody sound"
        if abs(tilt - usual.mean) > BEYOND * usual.sd
        else f"and the walk shows the hips farther {'forward' if low else 'back'} than these "
        "spines say"
    )
    yield QualityFlag(
        "height of the front spines",
        " and ".join(landmarks.get(name, name) for name in FRONT),
        abs(off.value), off.limit, "m",
        f"the pelvis is tilted by {np.degrees(tilt):.0f}° in standing "
        f"({np.degrees(usual.mean):.0f} ± {np.degrees(usual.sd):.0f}° in others), {shown}: both "
        f"are some {1000 * abs(off.value):.0f} mm too {'low' if low else 'high'} on the pelvis "
        f"(sound people are within {1000 * off.limit:.0f} mm), as over a belt or a belly, or "
        "the rear ones the other way. Tilt of the pelvis and flexion of the hips are off by some "
        "degrees all the time. Feel for all four spines and put the markers on them",
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


def _by_sine(angle: Array) -> Array:
    return np.column_stack([np.sin(angle), np.ones(len(angle))])


def _by_sine_and_cosine(angle: Array) -> Array:
    return np.column_stack([np.sin(angle), 1.0 - np.cos(angle), np.ones(len(angle))])


def _parting(
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
    side: str,
    table: Callable[[Array], Array],
) -> Array | None:
    """m, by which the distance from the knee's to the ankle's marker grows with each column of the
    `table` of the knee's flexion, and the root mean square of the rest; None where they are not
    seen, or the knee does not bend.
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
    columns, apart = table(angle), np.concatenate(parted)
    found = np.linalg.lstsq(columns, apart, rcond=None)[0]
    left = float(np.sqrt(np.mean((apart - columns @ found) ** 2)))
    return np.append(found[:-1], left)


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
