"""The anterior superior iliac spines of a pelvis that has markers on its crests and at its rear.

Where a belly, a belt or a device covers the spines, laboratories put markers on the iliac crests
instead. Where the spines are then follows from the drawn people of `body.py`: in the frame of the
crests and of the rear, by linear regression on the width between the crests and the depth behind
them. What is left over of the drawn people's spines is how far one may be off.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.scaling.landmarks import unit_vector
from gaitval.scaling.markers.body import drawn_places, sites

CRESTS: Final = ("R.Crest", "L.Crest")
SPINES: Final = ("R.ASIS", "L.ASIS")
REARS: Final = (("R.PSIS", "L.PSIS"), ("Sacrum",))
"""What is behind, the better first."""


@dataclass(frozen=True)
class Spines:
    """Where the spines are taken to be.

    Attributes
    ----------
    places : (3,) m of `R.ASIS` and `L.ASIS`, in the axes of the markers.
    sd : (3,) m, standard deviation of either, forward (from the rear), left, up.
    tilt_sd : rad, of the tilt of the pelvis, by the height of the spines over their distance from
        the rear.
    rear : the landmarks behind that were used.
    """

    places: Mapping[str, Array]
    sd: Array
    tilt_sd: float
    rear: tuple[str, ...]


def rear_of(names: Collection[str]) -> tuple[str, ...] | None:
    """The landmarks at the rear among `names` that the spines can be found with, or None."""
    return next((rear for rear in REARS if set(rear) <= set(names)), None)


def spines_of(points: Mapping[str, Array]) -> Spines | None:
    """The spines of a standing person by `points` (3,) m on the crests and the rear; None if these
    are not there.
    """
    rear = rear_of(list(points))
    if rear is None or not set(CRESTS) <= set(points):
        return None
    known = np.stack([points[name] for name in (*CRESTS, *rear)])
    weights, sd = _regression(rear)
    origin, axes = _frame(known)
    places = (_features(known) @ weights).reshape(2, 3)
    across = np.sqrt(np.mean(sd.reshape(2, 3) ** 2, axis=0))
    # Both are raised by what the crests share: the mean is taken to be no surer than either.
    depth = float(np.mean(places[:, 0]) - (_local(known)[2:, 0]).mean())
    return Spines(
        dict(zip(SPINES, origin + places @ axes.T, strict=True)),
        across,
        float(np.arctan2(across[2], depth)),
        rear,
    )


@cache
def _regression(rear: tuple[str, ...]) -> tuple[Array, Array]:
    """(F, 6) weights of the spines in the frame of the crests, and (6,) m standard deviations."""
    labels = [site.label for site in sites()]
    marked, true = drawn_places("arms hang")
    known = marked[:, [labels.index(name) for name in (*CRESTS, *rear)]]
    wanted = true[:, [labels.index(name) for name in SPINES]]
    features = np.stack([_features(each) for each in known])
    local = np.stack(
        [
            ((spines - origin) @ axes).ravel()
            for spines, (origin, axes) in zip(wanted, map(_frame, known), strict=True)
        ]
    )
    weights = np.linalg.lstsq(features, local, rcond=None)[0]
    return weights, (local - features @ weights).std(axis=0)


def _frame(known: Array) -> tuple[Array, Array]:
    """Middle of the crests, and axes as columns: left along the crests, forward from the rear."""
    right, left, *rear = known
    middle = (right + left) / 2
    y = unit_vector(left - right)
    forward = middle - np.mean(rear, axis=0)
    x = unit_vector(forward - (forward @ y) * y)
    return middle, np.column_stack([x, y, np.cross(x, y)])


def _local(known: Array) -> Array:
    origin, axes = _frame(known)
    return np.asarray((known - origin) @ axes)


def _features(known: Array) -> Array:
    """Width of the crests, depth of the rear behind them, and 1."""
    local = _local(known)
    return np.array([local[1, 1] - local[0, 1], -local[2:, 0].mean(), 1.0])
