"""Whether the markers of the knees lie where the knees turn, by the walk itself.

A marker beside the knee's axis comes nearer to the ankle, or goes farther from it, as the knee
bends: one that is 18 mm too far back by 14 mm times the sine of the flexion. It also makes that
knee look straighter in standing, and the fit to the walk moves it forward. Skin does the first to
both knees of a person, people stand with knees bent unlike, and each of the three alone is as large
in sound recordings; their sum, right less left, is not. So a marker is seen that is misplaced in
all trials alike, and one that was moved between them.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.gait.quality_flags import QualityFlag
from gaitval.session.odd_sides import turned_outwards
from gaitval.session.trial import WalkingTrial

if TYPE_CHECKING:
    from gaitval.scaling.landmarks import Place
    from gaitval.session.scale import FittedBody

NEARER: Final = 0.47
FITTED: Final = 1.6
STRAIGHTER: Final = 0.062
"""How far forward the right knee's marker lies beside the left one's, m, for each m by which its
distance to the ankle grows more with the sine of the flexion, for each m that the fit to the walk
moves it forward on its segment, and for each rad that the knee is bent more in standing: what finds
18 mm best in eleven children of McGill, one person of Luxembourg and one of Stanford."""
SOUND: Final = 0.0033
"""m, SD of that sum in the same thirteen recordings, each left out once (0.0031 else)."""
HALF_SEEN: Final = 0.7
"""Of the sum where a medial marker holds the joint's centre half as far back."""
LEAST_SHARE: Final = 0.25
"""Of the sum, what the walk itself shows at least of a misplaced marker: 0.36 to 1.0 of one that is
18 mm forward or back, on either side, of two children, an adult of Luxembourg and one of Stanford.
Who stands with one knee more bent, as after a stroke or with a contracture, has less (0.1 of 13 mm
in a boy with cerebral palsy), and no marker is beside its place."""
LINE: Final = float(np.radians(3.6))
"""rad, SD of what the lines through the epicondyles are turned by, right less left, of the ten
built-in people."""
BEYOND: Final = 3.0
"""SD that nobody who is sound is beyond."""
LEAST_FLEXION: Final = float(np.radians(30.0))
"""rad that both knees bend by; in walking 50 to 70 degrees."""
LEAST_FRAMES: Final = 30


class KneePlaces(NamedTuple):
    """How far forward the right knee's marker lies of where it should, less the left one's, the SD
    of that in sound recordings, m, and whether more says so than how the person stands.
    """

    forward: float
    sound: float
    shown: bool = True


def knee_places(
    body: "FittedBody",
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
    points: "Mapping[str, Place]",
) -> KneePlaces | None:
    """By all `walks` and the `points` (3,) m on landmarks in standing; None where knees and ankles
    have no markers in a walk, or do not bend. `landmarks` names the landmarks' markers.
    """
    grows = [np.subtract(*pair) for walk in walks if (pair := _growing(walk, landmarks))]
    fitted = {marker.name: marker.position[0] for marker in body.markers}
    placed = {marker.name: marker.position[0] for marker in body.placement.markers}
    knees = [landmarks.get(f"{side}.Knee", "") for side in "RL"]
    if not grows or not all(name in fitted and name in placed for name in knees):
        return None
    moved = np.subtract(*(fitted[name] - placed[name] for name in knees))
    right, left = (COORDINATES.index(f"knee_angle_{side}") for side in "rl")
    bent = body.placement.standing[right] - body.placement.standing[left]
    in_walk = float(NEARER * np.mean(grows) + FITTED * moved)
    forward = in_walk + float(STRAIGHTER * bent)
    shown = abs(in_walk) >= LEAST_SHARE * abs(forward) and in_walk * forward >= 0.0
    if not any(f"{side}.Knee.Medial" in points for side in "RL"):
        return KneePlaces(forward, SOUND, shown)
    forward, sound = forward / HALF_SEEN, SOUND / HALF_SEEN
    turned = [turned_outwards(points, side) for side in "RL"]
    if turned[0] is None or turned[1] is None:
        return KneePlaces(forward, sound, shown)
    width = np.mean([
        np.linalg.norm(np.subtract(points[f"{side}.Knee"], points[f"{side}.Knee.Medial"]))
        for side in "RL"
    ])  # fmt: skip
    line, of_line = float(width) * (turned[0] - turned[1]), float(width) * LINE
    weights = np.array([sound**-2, of_line**-2])
    both = float(weights @ [forward, line] / weights.sum())
    return KneePlaces(both, float(weights.sum() ** -0.5))


def knee_place_warnings(
    places: KneePlaces | None, landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """Warning about a knee's marker beside the axis that the walk shows: one at most."""
    if places is None or not places.shown or abs(places.forward) <= BEYOND * places.sound:
        return
    right, left = (landmarks[f"{side}.Knee"] for side in "RL")
    back, forward = (right, left) if places.forward < 0.0 else (left, right)
    off = abs(places.forward)
    yield QualityFlag(
        "place of a knee's marker", f"{right} and {left}", off, BEYOND * places.sound, "m",
        f"by how the knees turn in the walk, {back} is some {1000 * off:.0f} mm too far back, or "
        f"{forward} too far forward (sound pairs are within {1000 * BEYOND * places.sound:.0f} mm "
        "of each other): one of them, or the ankle's below it the other way, is misplaced in all "
        "trials alike or was moved between standing and walk, and the leg's angles are off by "
        "some degrees. Put both on the axis that the knee bends about, and record standing and "
        "walk with the markers untouched",
    )  # fmt: skip


def _growing(walk: WalkingTrial, landmarks: Mapping[str, str]) -> tuple[float, float] | None:
    """m, by which the distance from the knee's to the ankle's marker grows with the sine of the
    knee's flexion, right and left.
    """
    found = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{joint}", "") for joint in ("Knee", "Ankle")]
        if not all(name in walk.recording.names for name in names):
            return None
        knee, ankle = (walk.recording.marker(name) for name in names)
        apart: Array = np.linalg.norm(knee - ankle, axis=1)
        angle = walk.kinematics.positions[:, COORDINATES.index(f"knee_angle_{side.lower()}")]
        seen = np.isfinite(apart) & walk.kinematics.converged
        if seen.sum() < LEAST_FRAMES or np.ptp(angle[seen]) < LEAST_FLEXION:
            return None
        found.append(float(np.polyfit(np.sin(np.abs(angle[seen])), apart[seen], 1)[0]))
    return found[0], found[1]
