"""Whether two trials show the same person: distances between markers of one segment.

In one person with the same markers, such distances hardly change from standing to walking (median
0.8 mm, at most 4 mm in WBDS01; median 1.7 mm in the walk of Rajagopal et al. 2016). Between people
they differ (medians of 12 to 36 mm between WBDS01 and the other nine built-in subjects).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.scaling.marker_sets import MarkerSet

LARGEST_MEDIAN: Final = 0.006
"""m. The largest median seen within one person is 1.7 mm, the smallest between two people 11.6
mm."""

LARGEST_CHANGE: Final = 0.025
"""m. More than skin can move one marker of a segment relative to another: at most 17 mm in the walk
of Rajagopal et al. 2016 (thigh), 6 mm in those of WBDS01. Does not apply to the trunk: shoulders
lift by 6 cm."""

SHORTEST: Final = 0.03
"""m; closer markers say nothing about a person."""

FEWEST: Final = 4
"""Number of distances needed for a verdict."""


@dataclass(frozen=True)
class MarkerDistance:
    """Distance of two markers of one segment in both trials, m; medians over frames."""

    markers: tuple[str, str]
    standing: float
    walking: float

    @property
    def change(self) -> float:
        """Walking less standing, m."""
        return self.walking - self.standing


def marker_distances(
    standing: Mapping[str, Array], walking: Mapping[str, Array], marker_set: MarkerSet
) -> tuple[MarkerDistance, ...]:
    """Distances between all markers of one segment that both trials show.

    Parameters
    ----------
    standing, walking : (T, 3) m, each marker of the set; NaN where not seen.
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
        if np.isfinite(medians).all() and medians[0] > SHORTEST:
            found.append(MarkerDistance((first, second), *medians))
    return tuple(found)


def displaced(
    distances: Iterable[MarkerDistance], marker_set: MarkerSet
) -> tuple[MarkerDistance, ...]:
    """Distances that change by more than `LARGEST_CHANGE`: in one of the trials one of the two
    markers was moved, fell off or has another marker's name.
    """
    return tuple(
        distance
        for distance in distances
        if abs(distance.change) > LARGEST_CHANGE
        and marker_set.markers[distance.markers[0]].segment != "torso"
    )


def check_same_person(
    standing: Mapping[str, Array],
    walking: Mapping[str, Array],
    marker_set: MarkerSet,
    *,
    names: tuple[str, str] = ("the standing trial", "the walking trial"),
) -> tuple[MarkerDistance, ...]:
    """Refuse a standing trial whose person or markers are not those of the walking trial.

    Parameters
    ----------
    standing, walking : (T, 3) m, each marker of the set; NaN where not seen.
    names : of the trials, for the message.

    Returns
    -------
    tuple : the distances that were compared, for a report.

    Raises
    ------
    RecordError : half of the distances change by more than `LARGEST_MEDIAN`; the largest are
        listed.
    """
    distances = marker_distances(standing, walking, marker_set)
    median = float(np.median([abs(d.change) for d in distances])) if distances else 0.0
    if len(distances) < FEWEST or median <= LARGEST_MEDIAN:
        return distances
    worst = sorted(distances, key=lambda d: -abs(d.change))[:5]
    raise RecordError(
        f"{names[0]} and {names[1]} do not show the same person with the same markers: the median "
        f"difference of distances between markers of one segment is {1000 * median:.0f} mm "
        f"(plausible: up to {1000 * LARGEST_MEDIAN:.0f} mm). The largest are\n"
        "  "
        + "\n  ".join(
            f"{d.markers[0]} to {d.markers[1]}: {1000 * d.standing:.0f} mm standing, "
            f"{1000 * d.walking:.0f} mm walking"
            for d in worst
        )
        + "\nUse the standing trial of this session, or check the names of the markers."
    )
