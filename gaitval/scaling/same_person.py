"""Whether two trials show the same person: distances between markers of one segment.

In one person with the same markers, such distances hardly change from standing to walking; between
people they differ. Measured on 16 people with the markers of Plug-in Gait (twelve children of
biomechZoo, four of BTKData; 16 pairs of trials of one person, 240 of two), without the trunk:

| mm                                                | one person  | two people, fewest |
|---------------------------------------------------|-------------|--------------------|
| mean change without the marker that changed most  | 2.2 at most | 4.2                |
| median change                                     | 2.3 at most | 2.1                |

The median alone passed a walker of 93 kg with the standing trial of another. In WBDS01 and the walk
of Rajagopal et al. 2016, whose sets have more markers, the medians are 0.8 and 1.7 mm.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.scaling.marker_set import MarkerSet


@dataclass(frozen=True)
class SamePersonLimits:
    """How much the distances of markers of one person may change."""

    largest_median: float = 0.0025
    """m. Two markers that were moved do not change the median, so both limits must be passed."""
    largest_mean: float = 0.0032
    """m, of the mean change without the marker that changed most. Between 2.2 mm, the largest of
    one person, and 4.2 mm, the smallest of two."""
    largest_change: float = 0.025
    """m. More than skin can move one marker of a segment relative to another: at most 17 mm in the
    walk of Rajagopal et al. 2016 (thigh), 6 mm in those of WBDS01. Does not apply to the trunk:
    shoulders lift by 6 cm."""
    firm_change: float = 0.015
    """m. The same on shanks and feet, where little is between skin and bone: at most 9.0 mm (heel
    to top of the midfoot) in six walks of three people, 4 mm on shanks."""
    shortest: float = 0.03
    """m; closer markers say nothing about a person."""
    fewest: int = 4
    """Number of distances needed for a verdict."""


SAME: Final = SamePersonLimits()


_FIRM: Final = ("shank", "foot")


@dataclass(frozen=True)
class MarkerDistance:
    """Distance of two markers of one segment in both trials, m; medians over frames. In one person
    it changes by `limit` at most.
    """

    markers: tuple[str, str]
    standing: float
    walking: float
    limit: float = SAME.largest_change

    @property
    def change(self) -> float:
        """Walking less standing, m."""
        return self.walking - self.standing


def marker_distances(
    standing: Mapping[str, Array], walking: Mapping[str, Array], marker_set: MarkerSet
) -> tuple[MarkerDistance, ...]:
    """Distances between all markers of one segment of `marker_set` that both trials show.

    `standing` and `walking` are (T, 3) m, each marker of the set; NaN where not seen.
    """
    found = []
    for first, second in combinations(marker_set.markers, 2):
        both = {first, second}
        if marker_set.markers[first].segment != marker_set.markers[second].segment or not (
            both <= standing.keys() and both <= walking.keys()
        ):
            continue
        medians = []
        for trial in (standing, walking):
            distances = np.linalg.norm(trial[first] - trial[second], axis=-1)
            distances = distances[np.isfinite(distances)]
            medians.append(float(np.median(distances)) if len(distances) else np.nan)
        if np.isfinite(medians).all() and medians[0] > SAME.shortest:
            limit = largest_change(marker_set.markers[first].segment)
            found.append(MarkerDistance((first, second), medians[0], medians[1], limit))
    return tuple(found)


def displaced(
    distances: Iterable[MarkerDistance], marker_set: MarkerSet
) -> tuple[MarkerDistance, ...]:
    """Of `distances` between markers of `marker_set`, those that change by more than
    their limit: in one of the trials one of the two markers was moved, fell off or has another
    marker's name.
    """
    return tuple(
        distance
        for distance in distances
        if abs(distance.change) > distance.limit
        # The trunk bends: distances on it change in one person too.
        and marker_set.markers[distance.markers[0]].segment != "torso"
    )


def largest_change(segment: str) -> float:
    """m, by which a distance on this `segment` changes in one person at most."""
    return SAME.firm_change if segment.partition("_")[0] in _FIRM else SAME.largest_change


def check_same_person(
    standing: Mapping[str, Array],
    walking: Mapping[str, Array],
    marker_set: MarkerSet,
    *,
    names: tuple[str, str] = ("the standing trial", "the walking trial"),
) -> tuple[MarkerDistance, ...]:
    """Refuse a standing trial whose person or markers are not those of the walking trial; returns
    the distances that were compared, for a report. `standing` and `walking` have (T, 3) m of each
    marker of `marker_set`, NaN where not seen; `names` of the trials are for the message. Raises
    RecordError, which lists the largest, if distances change by more than `SAME.largest_median` and
    `SAME.largest_mean`.
    """
    distances = marker_distances(standing, walking, marker_set)
    firm = [d for d in distances if marker_set.markers[d.markers[0]].segment != "torso"]
    if len(firm) < SAME.fewest:
        return distances
    median = float(np.median([abs(d.change) for d in firm]))
    moved, changes = _without_worst(firm)
    mean = float(changes.mean())
    if median <= SAME.largest_median or mean <= SAME.largest_mean:
        return distances
    error = float(changes.std(ddof=1) / np.sqrt(len(changes)))
    worst = sorted(firm, key=lambda d: -abs(d.change))[:5]
    raise RecordError(
        f"{names[0]} and {names[1]} do not show the same person with the same markers: {len(firm)} "
        f"distances between markers of one segment differ by {1000 * median:.1f} mm in the median "
        f"and, without {moved}, by {1000 * mean:.1f} ± {1000 * error:.1f} mm (mean and its "
        f"standard error; one person: up to {1000 * SAME.largest_median:.1f} and "
        f"{1000 * SAME.largest_mean:.1f} mm). The largest are\n"
        "  "
        + "\n  ".join(
            f"{d.markers[0]} to {d.markers[1]}: {1000 * d.standing:.0f} mm standing, "
            f"{1000 * d.walking:.0f} mm walking"
            for d in worst
        )
        + "\nUse the standing trial of this session, or check the names of the markers."
    )


def _without_worst(distances: Sequence[MarkerDistance]) -> tuple[str, Array]:
    """The marker whose distances change most, and the sizes of the changes without it, m."""
    markers = {marker for distance in distances for marker in distance.markers}
    left = {
        marker: np.array([abs(d.change) for d in distances if marker not in d.markers])
        for marker in sorted(markers)
    }
    enough = {marker: changes for marker, changes in left.items() if len(changes) > 1}
    moved = min(enough, key=lambda marker: float(enough[marker].mean()))
    return moved, enough[moved]
