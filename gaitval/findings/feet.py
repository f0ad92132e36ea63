"""Whether markers are on the segments of a walk where they are in standing, by distances and by the
heights of flat feet.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.findings.finding import Finding, Seen
from gaitval.mocap.recording import Recording
from gaitval.scaling.same_person import MarkerDistance

ON_FEET: Final = ("Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")
FLAT_PERCENTILE: Final = 15.0
"""Of a marker's height over the trial: a foot is flat for a quarter of the stride or more."""


@dataclass(frozen=True)
class Beside:
    """A walk beside the standing trial, both cleaned and in the project's axes.

    Attributes
    ----------
    landmarks : the marker on each.
    moved : distances on a segment that differ between the two (`same_person.displaced`).
    stood : False for a pose that was put together from the walk; the heights of its feet say
        nothing.
    """

    standing: Recording
    walking: Recording
    landmarks: Mapping[str, str]
    moved: Sequence[MarkerDistance] = ()
    stood: bool = True


def _moved(beside: Beside) -> Iterator[Seen]:
    for one in beside.moved:
        words = {"stood": one.standing, "walked": one.walking}
        limits = -np.inf, one.limit
        yield Seen(abs(one.change), " to ".join(one.markers), words, limits=limits)


def _heights(beside: Beside, *, fewest: int) -> Iterator[Seen]:
    """m, by which a marker is higher in the walk's flat foot than in standing. Another height of
    the floor moves all alike, so the median change is taken out.
    """
    changes = _height_changes(beside)
    if len(changes) < fewest:
        return
    floor = float(np.median(list(changes.values())))
    for mark, change in changes.items():
        way = "higher" if change > floor else "lower"
        yield Seen(abs(change - floor), beside.landmarks[mark], {"way": way})


def _height_changes(beside: Beside) -> dict[str, float]:
    """How much higher each landmark of the feet is in the walk's flat foot than in standing, m;
    none where the person did not stand.
    """
    changes: dict[str, float] = {}
    for landmark, name in beside.landmarks.items() if beside.stood else ():
        there = name in beside.standing.names and name in beside.walking.names
        if not there or landmark.rpartition(".")[2] not in ON_FEET:
            continue
        stood, walked = (trial.marker(name)[:, 2] for trial in (beside.standing, beside.walking))
        stood, walked = stood[np.isfinite(stood)], walked[np.isfinite(walked)]
        if len(stood) and len(walked):
            flat = np.percentile(walked, FLAT_PERCENTILE)
            changes[landmark] = float(flat - np.median(stood))
    return changes


MOVED: Final[Finding] = Finding(
    name="displaced marker",
    needs=Beside,
    values=_moved,
    limits=0.0,
    unit="m",
    sentence=(
        "{stood:.0f mm} in standing, {walked:.0f mm} in walking: one of the two has moved, or is "
        "not the same marker; left as it is"
    ),
    remedy="Check the labels",
)
HEIGHT: Final[Finding] = Finding(
    name="height of a foot's marker",
    needs=Beside,
    values=_heights,
    numbers={"fewest": 4},
    limits=0.02,
    unit="m",
    sentence=(
        "with the foot flat it is {value:.0f mm} {way} in walking than in standing (elsewhere "
        "within {limit:.0f mm}): it has moved or is mislabelled in one of the trials, or the foot "
        "is never put down flat"
    ),
    source="within 8 mm",
)
