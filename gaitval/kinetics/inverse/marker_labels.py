"""Check that a walking trial names its markers as the standing trial does."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker


@dataclass(frozen=True)
class LabelLimits:
    """When labels of markers were exchanged."""

    frames: int = 20
    """Number of frames of a trial that are checked, evenly spaced."""
    smallest_distance: float = 0.05
    """m. Two markers whose distances from their places add up to less than this are where they
    belong."""
    exchanged: float = 0.75
    """Two markers are exchanged if the sum of their distances to each other's places on the model
    is less than this fraction of the sum of distances to their own. For all exchanges of two
    markers on the right side of WBDS01 T01 the ratio is at most 0.62; without an exchange it is at
    least 13 there, and 2.3 in the walk of Rajagopal et al. 2016, whose thigh markers slide most."""


LABELS: Final = LabelLimits()


@dataclass(frozen=True)
class Exchange:
    """Two markers that have each other's names in a walking or a standing trial.

    Attributes
    ----------
    first, second : their names.
    own, crossed : m, sum of both distances from their own places on the body, and from each
        other's; medians over frames.
    """

    first: str
    second: str
    own: float
    crossed: float

    def __str__(self) -> str:
        return (
            f"according to the standing trial they are {1000 * self.own:.0f} mm off their places "
            "on the body (sum of both, median), but with the names exchanged only "
            f"{1000 * self.crossed:.0f} mm"
        )


def find_exchanged(
    model: BodyModel, markers: Sequence[ModelMarker], measured: Array
) -> Exchange | None:
    """The clearest pair of markers that have each other's names; None if there is none.

    The standing trial gives each of the M `markers` its place on the scaled `model`. After inverse
    kinematics of `measured` (T, M, 3) m, project axes, NaN where not seen, two exchanged markers
    are far from their own places and near each other's. Raises ModelError or RecordError as
    `inverse_kinematics`.
    """
    frames = np.unique(np.linspace(0, len(measured) - 1, LABELS.frames).astype(int))
    shown = np.isfinite(measured[frames]).all(axis=2).sum(axis=1)
    measured = measured[frames][shown >= 3]
    if not len(measured):
        return None
    pose = inverse_kinematics(model, markers, measured).positions
    expected = marker_positions(model, markers, pose)
    # (T, M, M): of each measured marker from the place of each marker
    distance = np.linalg.norm(measured[:, :, None] - expected[:, None], axis=3)
    # The pose gives way to both wrong labels, so even the crossed distances are not zero: the two
    # sums are compared.
    clearest, found = LABELS.exchanged, None
    for i, j in combinations(range(len(markers)), 2):
        both = np.isfinite(distance[:, i, i] + distance[:, j, j])
        if not both.any():
            continue
        own = float(np.median((distance[:, i, i] + distance[:, j, j])[both]))
        crossed = float(np.median((distance[:, i, j] + distance[:, j, i])[both]))
        if own > LABELS.smallest_distance and crossed < clearest * own:
            clearest = crossed / own
            found = Exchange(markers[i].name, markers[j].name, own, crossed)
    return found
