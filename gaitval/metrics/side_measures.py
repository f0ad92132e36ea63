"""Measures of one side that follow from its mean curves: the place for a verdict of a laboratory.

A row of `SIDE_MEASURES` is all that a measure needs: everything else about it, its unit, what it is
compared with, its check in a stored baseline, is read from there. `tolerances.toml` has its limits.
See docs/how-to/extend.md#add-a-verdict.
"""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side

if TYPE_CHECKING:
    from gaitval.gait.cycle_curves import Curves
    from gaitval.subjects.prediction.known import RecordedQuantity

LOADING: Final = slice(0, 31)
"""% of a side's cycle in which its vertical force has its first peak."""

FLAT: Final = slice(12, 53)
"""% of a side's cycle in which the ankle's moment is the ground's: the foot is loaded and its own
weight and inertia add less than a millimetre."""


class SideMeasure(NamedTuple):
    """A measure of each side.

    Attributes
    ----------
    name, unit : as in `tolerances.toml`.
    quantities : of the record that the walk is compared with; none if it is not compared.
    value : of the mean curves of a side, first of the walk and then of the record: (101,) by name
        without side, rad, Nm/kg and body weights. Raises KeyError for a curve that is not there.
    """

    name: str
    unit: str
    quantities: "tuple[RecordedQuantity, ...]"
    value: "Callable[[Curves, Curves], float]"


def pressure_arm(moment: Array, force: Array) -> Array:
    """How far ahead of the ankle the ground reaction acts on a foot, m, at `FLAT`: the
    plantarflexion moment (-`moment`, (101,) Nm/kg) over the vertical `force` (101,), body weights.
    """
    return np.asarray(-moment[FLAT] / (GRAVITY * force[FLAT]))


def _loading_peak(walked: "Curves", recorded: "Curves") -> float:
    """First peak of the vertical force, size of the difference, % of body weight."""
    first = walked.forces["vertical"][LOADING].max() - recorded.forces["vertical"][LOADING].max()
    return 100.0 * abs(float(first))


def _pressure_arm(walked: "Curves", recorded: "Curves") -> float:
    """How far ahead of the ankle the ground pushes, RMS of the difference, mm."""
    ours, theirs = (
        pressure_arm(each.moments["ankle_angle"], each.forces["vertical"])
        for each in (walked, recorded)
    )
    return 1e3 * float(np.sqrt(np.mean((ours - theirs) ** 2)))


SIDE_MEASURES: Final = (
    SideMeasure("loading_peak_error", "% BW", ("forces",), _loading_peak),
    SideMeasure("pressure_arm_rmse", "mm", ("moments", "forces"), _pressure_arm),
)


def side_values(walked: "Curves", recorded: "Curves") -> Iterator[tuple[str, Side, float | None]]:
    """Name, side and value of every measure, None where a curve is missing, of the mean curves
    (101,) `walked` and `recorded` of both sides, by name with side.
    """
    for side in SIDES:
        ours, theirs = _of_side(walked, side), _of_side(recorded, side)
        for measure in SIDE_MEASURES:
            try:
                value = measure.value(ours, theirs)
            except KeyError:  # a walk without a whole cycle of this side has no mean curves
                value = None
            yield measure.name, side, value


def _of_side(curves: "Curves", side: Side) -> "Curves":
    """The curves of a side, by name without it."""
    end = f"_{side[0]}"
    parts = (
        {name.removesuffix(end): curve for name, curve in part.items() if name.endswith(end)}
        for part in (curves.angles, curves.moments, curves.forces)
    )
    return type(curves)(*parts)
