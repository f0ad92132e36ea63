"""Markers misplaced in all trials alike: they show beside those of the other side only.

Such a marker moves joint centres and changes no distance between the trials.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.quality_flags import QualityFlag
from gaitval.scaling.landmarks import Place

SIDES_DIFFER: Final = {
    ("Ankle", "Ankle.Medial"): 0.007,
    ("Knee", "Knee.Medial"): 0.014,
    ("Heel", "Ankle"): 0.016,
}
"""m. Twice what right and left differ by, at most, of 12 people between the malleoli (3.4 mm) and
the epicondyles (7.8 mm), and 1.5 times that from heel to malleolus (10.9 mm)."""
SPINES_DIFFER: Final = 0.009
"""m. From an anterior spine of the pelvis to the posterior one of the other side, right and left
differ by at most 5.3 mm in the ten built-in people, and 6.4 in seven recordings of other
laboratories without a doubtful pelvis."""
HEELS_DIFFER: Final = 0.015
"""m. Outwards of the line from the middle of the malleoli to the middle of the metatarsal heads,
the heels' markers differ by at most 10.1 mm in the ten built-in people."""
HEELS_DIFFER_BY_ONE: Final = 0.020
"""m. The same with one marker on each forefoot: 6.8 mm (SD) in twelve children of McGill."""
HEIGHTS_DIFFER: Final = {
    "Heel": 0.014, "Ankle": 0.014, "Ankle.Medial": 0.015,
    "MT1": 0.011, "MT2": 0.010, "MT5": 0.011, "Toe": 0.010,
}  # fmt: skip
"""m, above the floor on which both feet stand: 4.5 (SD, at most 10, 11 and 13 mm) of 27 people of
twelve laboratories, 2.2 to 3.3 (at most 9) of the forefeet."""
FEET_DIFFER: Final = 0.014
"""m, along the foot from the heel's marker to the forefoot's: 4.7 (SD) of the same people, at most
10."""
ANKLES_DIFFER: Final = 0.017
"""m, along the foot from the heel's marker to the malleolus's: 5.6 (SD) of the same people but one
whose marker is misplaced (27), at most 13."""
REAR_FOOT: Final = ("Heel", "Ankle", "Ankle.Medial")
TIPTOE: Final = 0.5
"""Of how much higher a heel is than the other, from which on its ankle is, too: the heel is up."""
KNEE_LINES_DIFFER: Final = float(np.radians(7.5))
"""rad. The line through the epicondyles is turned against pelvis, malleoli and foot, in the mean of
the three, by at most 7.0° (SD 3.6°) more on one side than on the other of the ten built-in people:
one in 27 is beyond. A marker 18 mm too far back turns it by 8 to 10°."""


def odd_sides(
    points: Mapping[str, Place], estimated: Collection[str] = (), *, stood: bool = True
) -> Iterator[QualityFlag]:
    """Warnings about `points` (3,) m on landmarks of the standing trial whose distances, or the
    line through the epicondyles, differ between right and left more than people do; `estimated`
    landmarks have no marker that could be misplaced. Of a pose that was put together from the walk
    (not `stood`) the heights of the feet say nothing.
    """
    points = {name: at for name, at in points.items() if name not in estimated}
    of_feet = [*_odd_heels(points), *_odd_feet(points), *(_odd_heights(points) if stood else ())]
    for flag in _odd_distances(points):
        if flag.where.startswith("Heel"):
            of_feet.append(flag)
        else:
            yield flag
    yield from _odd_spines(points)
    yield from _odd_knee_lines(points)
    if of_feet:  # one marker makes all of them
        yield max(of_feet, key=lambda each: each.value / each.limit)


def _differ(
    where: str, sides: tuple[float, float] | None, limit: float, seen: str, *, off: str,
    wrong: str = "one of the four markers is misplaced", other: str = "the legs differ",
    unit: str = "m",
) -> Iterator[QualityFlag]:  # fmt: skip
    """A warning where the `sides`, right and left, differ by more than the `limit`. It says what is
    `seen` (with their values, mm or degrees, at {0} and {1}), what is `wrong` or what the `other`
    reason is, and what is `off` with it.
    """
    if sides is not None and abs(sides[0] - sides[1]) > limit:
        shown = seen.format(*(1000 * each for each in sides))
        yield QualityFlag(
            "sides that differ", where, abs(sides[0] - sides[1]), limit, unit,
            f"{shown}: {wrong}, in all trials alike, or {other}. Look at them in standing; {off}",
        )  # fmt: skip


def _odd_distances(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    for (one, other), limit in SIDES_DIFFER.items():
        pair = _distances(points, [(f"{side}.{one}", f"{side}.{other}") for side in "RL"])
        yield from _differ(
            f"{one} to {other}", pair, limit, "{0:.0f} mm on the right and {1:.0f} mm on the left",
            off="a joint's centre is off by half as much, and the foot turns with it",
        )  # fmt: skip


def _distances(
    points: Mapping[str, Place], names: list[tuple[str, str]]
) -> tuple[float, float] | None:
    """m, between two pairs of landmarks; None if one of them has no place."""
    if not all(name in points for pair in names for name in pair):
        return None
    first, second = (
        float(np.linalg.norm(np.subtract(points[one], points[other]))) for one, other in names
    )
    return first, second


def _odd_spines(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    pair = _distances(points, [("R.ASIS", "L.PSIS"), ("L.ASIS", "R.PSIS")])
    return _differ(
        "ASIS to the PSIS of the other side", pair, SPINES_DIFFER,
        "{0:.0f} mm from R.ASIS and {1:.0f} mm from L.ASIS",
        other="the pelvis is uneven",
        off="hip centres, and list and rotation of the pelvis, are off with it",
    )  # fmt: skip


def _odd_knee_lines(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    right, left = (turned_outwards(points, side) for side in "RL")
    if right is None or left is None:
        return
    widths = _distances(points, [(f"{side}.Knee", f"{side}.Knee.Medial") for side in "RL"])
    off = 1000 * abs(right - left) * float(np.mean(widths or 0.0))
    turned = abs(np.degrees(right - left))
    yield from _differ(
        "Knee to Knee.Medial", (float(np.degrees(right)), float(np.degrees(left))),
        float(np.degrees(KNEE_LINES_DIFFER)),
        "against pelvis, malleoli and foot the line through the epicondyles is turned by "
        f"{turned:.0f}° more on one side than on the other",
        wrong=f"one of the four markers is some {off:.0f} mm too far forward or back",
        off="the knee's angle is off by some degrees", unit="deg",
    )  # fmt: skip


def _odd_heels(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    right, left = (_heel_outwards(points, side) for side in "RL")
    if right is None or left is None:
        return
    yield from _differ(
        "Heel across the foot", (right, left),
        HEELS_DIFFER if len(_front(points)) > 1 else HEELS_DIFFER_BY_ONE,
        "the heels' markers are {0:.0f} mm (right) and {1:.0f} mm (left) outwards of the line from "
        "the malleoli to the metatarsal heads",
        wrong="one of the markers of a foot is misplaced", other="the feet differ",
        off="the foot, and the hip's rotation, are turned with it",
    )  # fmt: skip


def _odd_heights(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    """The landmark of the feet whose heights differ most for what they do in people."""
    apart = {
        name: points[f"R.{name}"][2] - points[f"L.{name}"][2]
        for name in HEIGHTS_DIFFER
        if f"R.{name}" in points and f"L.{name}" in points
    }
    shares = {name: abs(up) / HEIGHTS_DIFFER[name] for name, up in apart.items()}
    name = max(shares, key=lambda each: shares[each], default=None)
    if name is None or shares[name] <= 1.0:
        return
    rear = sorted((apart.get("Heel", 0.0), apart.get("Ankle", 0.0)), key=abs)
    if name in REAR_FOOT and rear[0] * rear[1] > TIPTOE * rear[1] ** 2:
        return  # one foot is not flat
    limit = HEIGHTS_DIFFER[name]
    yield from _differ(
        f"{name} above the floor", (points[f"R.{name}"][2], points[f"L.{name}"][2]), limit,
        "{0:.0f} mm on the right and {1:.0f} mm on the left in standing (elsewhere within "
        f"{1000 * limit:.0f} mm of each other)",
        wrong="one of the two is misplaced", other="one foot does not stand flat",
        off="the foot is turned with it, and the zero of the ankle",
    )  # fmt: skip


def _odd_feet(points: Mapping[str, Place]) -> Iterator[QualityFlag]:
    """How far ahead of the heel's marker those of forefoot and malleolus are, along the foot."""
    right, left = (_along_foot(points, side) for side in "RL")
    if right is None or left is None:
        return
    for at, what, where, limit in (
        (0, "the forefoot's", "Heel to forefoot", FEET_DIFFER),
        (1, "the malleolus's", "Heel to Ankle along the foot", ANKLES_DIFFER),
    ):
        yield from _differ(
            where, (right[at], left[at]), limit,
            f"along the foot {what} marker is {{0:.0f}} mm (right) and {{1:.0f}} mm (left) ahead "
            f"of the heel's (elsewhere within {1000 * limit:.0f} mm of each other)",
            wrong="one of the four is misplaced", other="the feet differ",
            off="foot and ankle angles are some degrees off",
        )  # fmt: skip


def _along_foot(points: Mapping[str, Place], side: str) -> tuple[float, float] | None:
    """m; None where a landmark has no place."""
    names = ["Heel", "Ankle", *_front(points)]
    if any(f"{side}.{name}" not in points for name in names):
        return None
    heel, ankle, *heads = (np.asarray(points[f"{side}.{name}"])[:2] for name in names)
    foot = np.mean(heads, axis=0) - heel
    length = float(np.linalg.norm(foot))
    return length, float((ankle - heel) @ foot) / length


def _heel_outwards(points: Mapping[str, Place], side: str) -> float | None:
    """m; None where a landmark has no place."""
    names = ["Knee", "Ankle", "Ankle.Medial", "Heel", *_front(points)]
    if any(f"{side}.{name}" not in points for name in names):
        return None
    at: dict[str, Array] = {name: np.asarray(points[f"{side}.{name}"]) for name in names}
    ankle = (at["Ankle"] + at["Ankle.Medial"]) / 2
    up = (at["Knee"] - ankle) / np.linalg.norm(at["Knee"] - ankle)
    ahead = _across(np.asarray(np.mean([at[name] for name in names[4:]], axis=0)) - ankle, up)
    right = np.cross(ahead, up) / np.linalg.norm(ahead)
    return float((at["Heel"] - ankle) @ right) * (1.0 if side == "R" else -1.0)


def _front(points: Mapping[str, Place]) -> tuple[str, ...]:
    """Landmarks that show the middle of both forefeet: of sets with one marker there, that one."""
    for names in (("MT1", "MT5"), ("MT2",), ("Toe",)):
        if all(f"{side}.{name}" in points for side in "RL" for name in names):
            return names
    return ("MT1", "MT5")


def turned_outwards(points: Mapping[str, Place], side: str) -> float | None:
    """rad, by which the line from the medial to the lateral epicondyle is turned about the shank,
    its lateral end backwards, against the mean of pelvis, malleoli and foot; None where a landmark
    has no place.
    """
    names = ["Knee", "Knee.Medial", "Ankle", "Ankle.Medial", "Heel", "MT1", "MT5", "ASIS"]
    other = "L" if side == "R" else "R"
    if f"{other}.ASIS" not in points or any(f"{side}.{name}" not in points for name in names):
        return None
    at: dict[str, Array] = {name: np.asarray(points[f"{side}.{name}"]) for name in names}
    axis = at["Knee"] + at["Knee.Medial"] - at["Ankle"] - at["Ankle.Medial"]
    axis = axis / np.linalg.norm(axis)
    knee = _across(at["Knee"] - at["Knee.Medial"], axis)
    pelvis = _across(at["ASIS"] - np.asarray(points[f"{other}.ASIS"]), axis)
    ankle = _across(at["Ankle"] - at["Ankle.Medial"], axis)
    foot = _across((at["MT1"] + at["MT5"]) / 2 - at["Heel"], axis)
    angles = [
        np.arctan2(np.cross(one, two) @ axis, one @ two)
        for one, two in ((pelvis, knee), (ankle, knee), (foot, knee))
    ]
    return float(np.mean(angles)) * (1.0 if side == "R" else -1.0)


def _across(line: Array, axis: Array) -> Array:
    """What of a `line` (3,) is across an `axis` (3,) of length 1."""
    return np.asarray(line - (line @ axis) * axis)
