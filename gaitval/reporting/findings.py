"""What the headings of a report say: of each kind of curves, how far they are off."""

from collections.abc import Mapping
from typing import NamedTuple

from gaitval.coordinates import SIDES, Side
from gaitval.metrics.comparison import rmse_of
from gaitval.metrics.origin import curve_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.verdicts import CURVE_NAMES
from gaitval.reporting.tables import CURVES


class CurveFinding(NamedTuple):
    """Of the recorded curves of a kind, both sides, in the unit of `Metrics.units`.

    Attributes
    ----------
    mean : of their RMSE.
    worst, name, side : the largest RMSE, and the curve that has it.
    """

    mean: float
    worst: float
    name: str
    side: Side


def findings(metrics: Metrics) -> Mapping[str, CurveFinding | None]:
    """By kind; None where nothing was recorded or nothing walked."""
    found: dict[str, CurveFinding | None] = {}
    for kind, names, _ in CURVES:
        errors = [
            (value, CURVE_NAMES.get(name, name), side)
            for name in names
            for side in SIDES
            if curve_origin(kind, key := f"{name}_{side[0]}", metrics.origins) == "recorded"
            and (value := rmse_of(metrics.walk.errors.of(kind)[key])) is not None
        ]
        mean = sum(value for value, *_ in errors) / max(1, len(errors))
        found[kind] = CurveFinding(mean, *max(errors)) if errors else None
    return found
