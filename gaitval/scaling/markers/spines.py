"""The anterior superior iliac spines of a pelvis that has markers on its crests and at its rear.

Where a belly, a belt or a device covers the spines, laboratories put markers on the iliac crests
instead. Where the spines are then follows, in the frame of the crests and of the rear, by linear
regression on the width between the crests and the depth behind them. The regression is of 3000
drawn people: children and adults, whose spines, crests and rear lie in the pelvis as in Winter
(2009), ANSUR II (2014) and Harrington et al. (2007), with the errors of who places markers. What is
left over of the drawn people's spines is how far one may be off.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.scaling.landmarks import unit_vector

CRESTS: Final = ("R.Crest", "L.Crest")
SPINES: Final = ("R.ASIS", "L.ASIS")
REARS: Final = (("R.PSIS", "L.PSIS"), ("Sacrum",))
"""What is behind, the better first."""
# fmt: off
REGRESSIONS: Final = {
    ("R.PSIS", "L.PSIS"): (
        np.array([
            [0.3506565239279893, -0.3064159776283117, -0.18783165348700814,
             0.3470372301747666, 0.2912952614835344, -0.19367355494301874],
            [-0.5324789729370272, -0.13628629089558492, -0.023266189191237036,
             -0.5428631280369747, 0.18133918037047128, -0.00401733418663203],
            [0.009092577081726061, -0.013451126921305845, -0.023244500015823424,
             0.011694331688483994, 0.013234498068254164, -0.02357455222386143],
        ]),
        np.array(
            [0.022411072256462775, 0.016891268480994932, 0.024734831628643133,
             0.022254083656603394, 0.017267425889722472, 0.024616808087042044]
        ),
    ),
    ("Sacrum",): (
        np.array([
            [0.34741539783958636, -0.3029771739404857, -0.18527351638172299,
             0.33949403749441176, 0.29694219210026146, -0.19084735256841753],
            [-0.4774127229450347, -0.1291856616272597, -0.05141483779108812,
             -0.4716821024607841, 0.14437555123532925, -0.03966457407426406],
            [0.004920303807464832, -0.013096108415814794, -0.023631053970682415,
             0.006797342831351305, 0.013419484914701185, -0.02336824201460761],
        ]),
        np.array(
            [0.023455333813998523, 0.016846663420447522, 0.02373924830908462,
             0.023705514101393026, 0.017328916195664, 0.023644016548746944]
        ),
    ),
}
# fmt: on
"""For each rear, (3, 6) weights of width, depth (`_features`) and 1 for forward, left and up of the
right and the left spine in the frame of the crests, and (6,) m standard deviations of these."""


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
    weights, sd = REGRESSIONS[rear]
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
