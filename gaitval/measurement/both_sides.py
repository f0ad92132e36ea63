"""Markers that are misplaced on both sides alike, and a standing pose unlike the walk.

What is wrong on both sides shows beside no other side, and moves no marker between the trials. The
walk shows it all the same, because a joint turns about one place:

- The marker of a knee that is too low comes nearer to the ankle as the knee bends, by the share
  1 - cos of its flexion of what it is too low by. Skin does so too, in everybody by about as much.
- With both front spines of the pelvis too low the pelvis looks tilted, and the regression puts its
  hips too far back. The joint fit brings them forward again, to where the thighs turn.

Neither is exact, so each is put together with what people are built like: how high a knee is below
the front spines, and how far a pelvis is tilted in standing.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.quality_flags import QualityFlag
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.session.trial import WalkingTrial

if TYPE_CHECKING:
    from gaitval.scaling.landmarks import Place
    from gaitval.session.scale import FittedBody

NEARER: Final = -0.0316
NEARER_SD: Final = 0.0095
"""m for each 1 - cos of the flexion, by which the knee's and the ankle's marker part, mean and SD
of 17 people (nine children of McGill, eight adults of as many laboratories). A marker that is 18 to
27 mm too high or low changes it by 0.88 to 1.02 of that in four of them."""
KNEE_SHARE: Final = 0.512
KNEE_SHARE_SD: Final = 0.0165
"""Height of the knees' markers over that of the front spines, in standing, of 20 people."""
KNEES_SD: Final = 0.0070
"""m, SD of what both say together in 15 of the same people (0.0067 there)."""
SKINLESS: Final = 0.001
"""m, left of the distance from knee to ankle beside the flexion, below which no skin was between
markers and bones: 2 to 6 mm in people, 0 in simulated markers."""
BEYOND: Final = 3.0
"""SD that nobody who is sound is beyond."""
UNTAPED: Final = 4.0
"""The same of the front spines where no leg was measured with a tape: hips and tilt alone differ
more in children with cerebral palsy (3.4 SD in one of two)."""
FORWARD: Final = 0.0013
FORWARD_SD: Final = 0.0029
"""m, by which the joint fit moves the hips forward in the pelvis from Harrington's regression, mean
and SD of 17 people with a standing trial."""
FORWARD_BY: Final = 0.25
"""Of what both spines are too low by: 0.21 to 0.27 in five people, two with clusters."""
TILT: Final = float(np.radians(10.5))
TILT_SD: Final = float(np.radians(7.5))
"""rad, tilt of the plane of the spines in standing, of the same people."""
SPINES_SD: Final = 0.012
"""m, SD of what both say together in the same people: they go together a little."""
LEG: Final = 0.008
LEG_SD: Final = 0.011
"""m, by which a leg measured with a tape, from spine to malleolus, is longer than from marker to
marker: of twelve children (McGill) and two adults whose files have it."""
TAPED: Final = -0.001
TAPED_SD: Final = 0.018
"""m, the same of these and of four sessions of a clinic's boys, whose tapes are shorter."""
LEAST_FLEXION: Final = float(np.radians(30.0))
LEAST_FRAMES: Final = 30
STANDS_BENT: Final = float(np.radians(10.0))
"""rad, by which both knees may be bent more in standing than where the walk stretches them most:
-3.5 to 6.6° in 17 people."""
ONE_BENT: Final = float(np.radians(13.0))
"""rad, the same of one knee: at most 7.6° of the same people."""
STANDS_TURNED: Final = float(np.radians(20.0))
"""rad, by which one foot more than the other may be turned out in standing from how it is in the
walk: 7° (SD), at most 17° of the same people."""
FRONT: Final = ("R.ASIS", "L.ASIS")
REAR: Final = ("R.PSIS", "L.PSIS", "Sacrum")
STRETCHED: Final = 2.0
"""Percentile of the knee's flexion over the walk."""
FLAT: Final = 0.25
"""m/s of the ankle, below which a foot lies flat."""


class TooLow(NamedTuple):
    """How much both sides' markers are too low, and the SD of that in sound people, m, of which a
    warning needs as many as `beyond`.
    """

    value: float
    sound: float
    beyond: float = BEYOND

    @property
    def limit(self) -> float:
        """m."""
        return self.beyond * self.sound


def low_knees(
    walks: Sequence[WalkingTrial], landmarks: Mapping[str, str], points: "Mapping[str, Place]"
) -> TooLow | None:
    """By all `walks` and the `points` (3,) m on landmarks in standing; None where the walks do not
    show both knees' and ankles' markers. `landmarks` names the landmarks' markers.
    """
    nearer = [_nearer(walks, landmarks, side) for side in "RL"]
    names = [f"{side}.{name}" for side in "RL" for name in ("Knee", "ASIS")]
    if nearer[0] is None or nearer[1] is None or any(name not in points for name in names):
        return None
    knees, spines = (
        float(np.mean([points[f"{side}.{name}"][2] for side in "RL"])) for name in ("Knee", "ASIS")
    )
    by_walk = float(np.mean([nearer[0], nearer[1]])) - NEARER
    by_build = KNEE_SHARE * spines - knees
    return _together((by_walk, NEARER_SD), (by_build, KNEE_SHARE_SD * spines), KNEES_SD)


def low_spines(
    body: "FittedBody", points: "Mapping[str, Place]", taped: Sequence[float | None] = ()
) -> TooLow | None:
    """By the joint fit of the `body`, its tilt in standing and the lengths of the legs, right and
    left, if they were `taped` (m); `points` (3,) m are on landmarks in standing. None where the fit
    moves no hips.
    """
    forward = body.chosen.hip_forward
    rear = [np.asarray(points[name]) for name in REAR if name in points]
    if forward is None or not rear or any(name not in points for name in FRONT):
        return None
    front = np.mean([np.asarray(points[name]) for name in FRONT], axis=0)
    depth = float(np.linalg.norm(front - np.mean(rear, axis=0)))
    by_tilt = TooLow(depth * (body.chosen.pelvic_tilt - TILT), depth * TILT_SD)
    if abs(by_tilt.value) > by_tilt.limit:
        # the fit moves hips by 8 mm at most, and a tape says nothing of the rear spines
        return by_tilt
    found = _together(
        ((forward - FORWARD) / FORWARD_BY, FORWARD_SD / FORWARD_BY), by_tilt[:2], SPINES_SD
    )
    longer = taped_longer(points, taped)
    if longer is None:
        return found._replace(beyond=UNTAPED)
    by_tape = longer - LEG
    if abs(by_tape - found.value) > BEYOND * float(np.hypot(SPINES_SD, LEG_SD)):
        return found._replace(beyond=UNTAPED)  # somebody else's legs, or measured otherwise
    return _together((found.value, SPINES_SD), (by_tape, LEG_SD))


def taped_longer(points: "Mapping[str, Place]", taped: Sequence[float | None]) -> float | None:
    """m, by which the legs that were `taped`, right and left, are longer than from the front spine
    to the malleolus of `points` (3,) m on landmarks in standing; None where neither is known.
    """
    longer = [
        leg - float(np.linalg.norm(np.subtract(points[f"{side}.ASIS"], points[f"{side}.Ankle"])))
        for side, leg in zip("RL", taped, strict=False)
        if leg is not None and f"{side}.ASIS" in points and f"{side}.Ankle" in points
    ]
    return float(np.mean(longer)) if longer else None


def taped_warnings(longer: float | None) -> Iterator[QualityFlag]:
    """Warning about lengths of the legs in a file that are not those of whoever stands there."""
    if longer is None or abs(longer - TAPED) <= BEYOND * TAPED_SD:
        return
    yield QualityFlag(
        "leg lengths of the file", "leg lengths", abs(longer - TAPED), BEYOND * TAPED_SD, "m",
        f"those of the file are {1000 * abs(longer):.0f} mm "
        f"{'longer' if longer > 0 else 'shorter'} than from the front spines to the malleoli by "
        f"the markers (elsewhere within {1000 * BEYOND * TAPED_SD:.0f} mm): "
        "they are somebody else's or were typed wrong, or markers are misplaced, or the trials are "
        "not to scale. The markers are used here; Plug-in Gait puts its hip centres by these "
        "lengths, so its hip moments differ from those here. Measure the legs again, and look "
        "whether mass, stature and widths of the file are this person's",
    )  # fmt: skip


def _together(
    one: tuple[float, float], other: tuple[float, float], sound: float | None = None
) -> TooLow:
    """The mean of two (value, SD) with the weights of their variances; `sound` is its SD if they
    are not independent.
    """
    values, sds = np.array([one, other]).T
    weights = sds**-2
    value = float(weights @ values / weights.sum())
    return TooLow(value, float(weights.sum() ** -0.5) if sound is None else sound)


def low_knees_warnings(found: TooLow | None, landmarks: Mapping[str, str]) -> Iterator[QualityFlag]:
    """Warning about both knees' markers: one at most."""
    if found is None or abs(found.value) <= found.limit:
        return
    yield QualityFlag(
        "height of the knees' markers", " and ".join(landmarks[f"{side}.Knee"] for side in "RL"),
        abs(found.value), found.limit, "m",
        f"by how the knees turn in the walk, and by where knees are below the front spines, both "
        f"are some {1000 * abs(found.value):.0f} mm too {'low' if found.value > 0.0 else 'high'} "
        f"(sound people are within {1000 * found.limit:.0f} mm): thighs and shanks have "
        "wrong lengths, and hips and knees bend by some degrees too much or too little. Put them "
        "on the epicondyles, where the knee turns, in all trials",
    )  # fmt: skip


def low_spines_warnings(
    found: TooLow | None, landmarks: Mapping[str, str], tilt: float
) -> Iterator[QualityFlag]:
    """Warning about the front spines' markers of a pelvis that is tilted by `tilt` (rad) in
    standing: one at most.
    """
    if found is None or abs(found.value) <= found.limit:
        return
    low, alone = found.value > 0.0, abs(tilt - TILT) > BEYOND * TILT_SD
    shown = (
        "more than anybody sound"
        if alone
        else f"and the walk shows the hips farther {'forward' if low else 'back'} than these "
        "spines say"
    )
    yield QualityFlag(
        "height of the front spines",
        " and ".join(landmarks.get(f"{side}.ASIS", f"{side}.ASIS") for side in "RL"),
        abs(found.value), found.limit, "m",
        f"the pelvis is tilted by {np.degrees(tilt):.0f}° in standing "
        f"({np.degrees(TILT):.0f} ± {np.degrees(TILT_SD):.0f}° in others), {shown}: both are some "
        f"{1000 * abs(found.value):.0f} mm too {'low' if low else 'high'} on the pelvis (sound "
        f"people are within {1000 * found.limit:.0f} mm), as over a belt or a belly, or "
        "the rear ones the other way. Tilt of the pelvis and flexion of the hips are off by some "
        "degrees all the time. Feel for all four spines and put the markers on them",
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
        bent.append((float(standing[at]), float(np.percentile(angles, STRETCHED))))
    if len(bent) == len(SIDES):
        stood, walked = np.mean(bent, axis=0)
        more, one = max((stand - walk, stand) for stand, walk in bent)
        if stood - walked <= STANDS_BENT and more > ONE_BENT:
            stood, walked = one, one - more
        if stood - walked > STANDS_BENT:
            yield QualityFlag(
                "standing pose", "knees in standing", float(np.degrees(stood - walked)),
                float(np.degrees(STANDS_BENT)), "deg",
                f"they are, or one is, bent by {np.degrees(stood):.0f}° in standing, and by "
                f"{np.degrees(walked):.0f}° only where the walk stretches it: the person did not "
                "stand upright. Lengths are up to a centimetre, and the zero of angles some "
                "degrees off. Record standing again with straight knees, or leave --static out",
            )  # fmt: skip
    turned = _turned(model, standing, walks)
    if turned is not None and abs(turned) > STANDS_TURNED:
        yield QualityFlag(
            "standing pose", "feet in standing", float(np.degrees(abs(turned))),
            float(np.degrees(STANDS_TURNED)), "deg",
            f"in standing the {'right' if turned > 0.0 else 'left'} foot is turned out by "
            f"{np.degrees(abs(turned)):.0f}° more, beside the other, than in the walk: the zero of "
            "its hip's rotation and of its subtalar angle are some degrees off. Record standing "
            "with both feet as in walking",
        )  # fmt: skip


def _nearer(walks: Sequence[WalkingTrial], landmarks: Mapping[str, str], side: str) -> float | None:
    """m for each 1 - cos of a knee's flexion, by which its marker and the ankle's part beside what
    goes with the sine; None where they are not seen.
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
    table = np.column_stack([np.ones(len(angle)), np.sin(angle), 1.0 - np.cos(angle)])
    apart = np.concatenate(parted)
    found = np.linalg.lstsq(table, apart, rcond=None)[0]
    left = float(np.sqrt(np.mean((apart - table @ found) ** 2)))
    return float(found[2]) if left > SKINLESS else None


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
