"""Whether the body that stands is one that people have: its sides, its ankles, the widths given.

A marker that is misplaced in all trials alike moves joint centres and changes no distance between
the trials: it shows beside that of the other side only.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.findings.finding import Finding, Seen
from gaitval.scaling.landmarks import Place
from gaitval.scaling.measurements import UNLIKE_LEGS
from gaitval.scaling.scaling import PLAUSIBLE
from gaitval.scaling.segments import ScaledSegment

DISTANCES: Final = {
    ("Ankle", "Ankle.Medial"): 0.007,
    ("Knee", "Knee.Medial"): 0.014,
    ("Heel", "Ankle"): 0.016,
    ("ASIS", "other PSIS"): 0.009,
    ("ASIS", "Sacrum"): 0.015,
}
"""m, by which a distance may differ between right and left."""
HEIGHTS: Final = {
    "Heel": 0.014, "Ankle": 0.014, "Ankle.Medial": 0.015,
    "MT1": 0.011, "MT2": 0.010, "MT5": 0.011, "Toe": 0.010,
}  # fmt: skip
"""m, by which a height above the floor may, where both feet stand on it."""
SPINES: Final = 0.017
"""m, by which the height of a front spine above its rear one may."""
REAR_FOOT: Final = ("Heel", "Ankle", "Ankle.Medial")
TIPTOE: Final = 0.5
"""Of how much higher a heel is than the other, from which on its ankle is, too: the heel is up."""
WIDTHS: Final = {"knee width": (0.047, 0.09), "ankle width": (0.033, 0.056)}
"""Of stature."""


@dataclass(frozen=True)
class StandingBody:
    """The body by the standing trial.

    Attributes
    ----------
    points : (3,) m, where the landmarks with a marker are.
    lengths : of the body.
    widths : m, of joints as they were given, of one or of both sides, by the names of `WIDTHS`.
    height : stature, m.
    stood : False for a pose that was put together from the walk: the heights of its feet say
        nothing.
    longer_leg : right over left, of thigh, shank and foot alike (`Measurements.longer_leg`).
    """

    points: Mapping[str, Place]
    lengths: Sequence[ScaledSegment]
    widths: Mapping[str, float | tuple[float, float] | None]
    height: float
    stood: bool = True
    longer_leg: float = 1.0


def _sides(of: StandingBody) -> Iterator[Seen]:
    """m, by which the two sides differ."""
    for (one, other), limit in DISTANCES.items():
        sides = [_apart(of.points, f"{side}.{one}", _end(side, other)) for side in "RL"]
        yield from _differ(f"{one} to {other}", sides, limit)
    if all(f"{side}.{at}" in of.points for side in "RL" for at in ("ASIS", "PSIS")):
        above = [of.points[f"{side}.ASIS"][2] - of.points[f"{side}.PSIS"][2] for side in "RL"]
        yield from _differ("ASIS above PSIS", above, SPINES)
    heights = {
        name: [of.points[f"{side}.{name}"][2] for side in "RL"]
        for name in HEIGHTS
        if of.stood and all(f"{side}.{name}" in of.points for side in "RL")
    }
    up = {name: right - left for name, (right, left) in heights.items()}
    rear = sorted((up.get("Heel", 0.0), up.get("Ankle", 0.0)), key=abs)
    if rear[0] * rear[1] > TIPTOE * rear[1] ** 2:  # one foot is not flat
        up = {name: each for name, each in up.items() if name not in REAR_FOOT}
    if up:  # one marker makes several of them
        name = max(up, key=lambda each: abs(up[each]) / HEIGHTS[each])
        yield from _differ(f"{name} above the floor", heights[name], HEIGHTS[name])


def _end(side: str, name: str) -> str:
    """The landmark `name` of a side, or of the other side, or of the middle."""
    if name == "Sacrum":
        return name
    if name.startswith("other "):
        return f"{'L' if side == 'R' else 'R'}.{name.removeprefix('other ')}"
    return f"{side}.{name}"


def _apart(points: Mapping[str, Place], one: str, other: str) -> float:
    """m, between two landmarks; NaN if one has no place."""
    if one not in points or other not in points:
        return float("nan")
    return float(np.linalg.norm(np.subtract(points[one], points[other])))


def _differ(where: str, sides: Sequence[float], limit: float) -> Iterator[Seen]:
    right, left = (float(each) for each in sides)
    if np.isfinite(right - left):
        words = {"right": right, "left": left}
        yield Seen(abs(right - left), where, words, limits=(-np.inf, limit))


def _unlike(of: StandingBody) -> Iterator[Seen]:
    """How much longer one leg is, in every length."""
    side = "right" if of.longer_leg > 1.0 else "left"
    ratio = max(of.longer_leg, 1.0 / of.longer_leg)
    yield Seen(ratio, f"{side} leg" if ratio > 1.0 else "legs", {"more": ratio - 1.0})


def _legs(of: StandingBody) -> Iterator[Seen]:
    """m, by which a length of the right and the left leg differ."""
    for row in of.lengths:
        arm = row.segment in ("upper arm", "forearm")
        uneven = row.segment == "ankle height" and not of.stood
        if row.right_m is not None and row.left_m is not None and not arm and not uneven:
            words = {"right": row.right_m, "left": row.left_m}
            yield Seen(abs(row.right_m - row.left_m), row.segment, words)


def _ankles(of: StandingBody) -> Iterator[Seen]:
    """Height of the ankles over that which is expected of bare feet."""
    for row in of.lengths:
        if row.segment == "ankle height":
            yield Seen(row.factor, row.name, {"length": row.length_m})


def _widths(of: StandingBody) -> Iterator[Seen]:
    """Of stature."""
    for joint, (low, high) in WIDTHS.items():
        given = of.widths[joint]
        if given is not None:
            words = {"width": float(np.mean(given)), "least": low, "most": high}
            yield Seen(float(np.mean(given)) / of.height, joint, words, limits=(low, high))


UNLIKE: Final[Finding] = Finding(
    name="one leg is longer",
    needs=StandingBody,
    values=_unlike,
    limits=UNLIKE_LEGS,
    unit="1",
    sentence=(
        "its thigh, shank and foot are all longer than the other ones, by {more:.0f %} at least: "
        "no misplaced marker does that, so the legs differ, or the markers of one are those of "
        "somebody else. Each leg keeps its own lengths and markers' places"
    ),
    remedy="Say so beside the results",
    source=(
        "1.007 at most in twelve children (McGill); a patient of Plug-in Gait's samples has 1.09"
    ),
)
SIDES: Final[Finding] = Finding(
    name="sides that differ",
    needs=StandingBody,
    values=_sides,
    limits=0.0,
    unit="m",
    sentence=(
        "{right:.0f mm} on the right and {left:.0f mm} on the left in standing (elsewhere within "
        "{limit:.0f mm} of each other): a marker is misplaced, in all trials alike, or the sides "
        "differ. The joints beside it are off with it"
    ),
    remedy="Look at these markers in standing",
    source=(
        "twice what 12 people differ by between malleoli (3.4 mm) and epicondyles (7.8), 1.5 times "
        "that from heel to malleolus (10.9); from a front spine to the other rear one at most 6.4 "
        "in 17 people, to the sacrum 12.5 in thirteen; the lines through front and rear spines are "
        "turned by 3.9 degrees at most in ten, 17 mm in front; heights of feet 4.5 (SD) of 27 "
        "people of twelve laboratories, 2.2 to 3.3 of the forefeet"
    ),
    hidden_by=("one leg is longer",),
)
LEGS: Final[Finding] = Finding(
    name="legs that differ",
    needs=StandingBody,
    values=_legs,
    limits=PLAUSIBLE.usual_asymmetry,
    unit="m",
    sentence=(
        "right {right:.3f} m and left {left:.3f} m: a marker is off, or the legs differ. Both "
        "sides get the mean; --set scaling.symmetric=false, here and for gaitval subject, keeps "
        "each side's own"
    ),
)
ANKLES: Final[Finding] = Finding(
    name="ankle height",
    needs=StandingBody,
    values=_ankles,
    limits=PLAUSIBLE.highest_bare_ankle,
    unit="1",
    sentence=(
        "{length:.3f} m above the floor is {value:.2f} times what is expected of bare feet: the "
        "shoes have thick soles, the heels are up, or the floor is not at z = 0 (floor = 0.02 in a "
        "session file says that the person stands 2 cm higher)"
    ),
    hidden_by=("one leg is longer",),
)
JOINT_WIDTHS: Final[Finding] = Finding(
    name="widths",
    needs=StandingBody,
    values=_widths,
    limits=(0.0, np.inf),
    unit="1",
    sentence=(
        "{width:.3f} m is {value:.1f %} of the stature (elsewhere {least:.1f %} to {most:.1f %}): "
        "the width of another joint, or mistyped. The joint's centre is off by half of the "
        "difference"
    ),
    remedy="Measure again",
    source=(
        "ankles 0.0348 to 0.0502 of 6,068 adults (bimalleolar breadth, ANSUR II), knees 0.055 to "
        "0.077 of adults and twelve children (McGill)"
    ),
)
