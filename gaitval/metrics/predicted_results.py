"""What is predicted for a speed without a model, as typed models of `metrics.json`."""

from pydantic import Field

from gaitval.metrics.record_results import Kinds
from gaitval.metrics.typed import Count, Curve, Result, Share, Size


class StatisticalCurves(Kinds[Curve]):
    """Of each curve and side, in the units of the curves."""


class PredictionBand(Result):
    """Around each predicted curve, by how wrong predictions of recorded trials are, see
    gaitval/metrics/held_out.py.
    """

    share: Share
    """Of people whose curve is to be within it, at each percent."""
    trials: Count
    """Held out; two of a person with two speeds count once, for they are one difference."""
    people: Count
    away: Size
    """Difference of dimensionless speed from the nearest known trial; the band grows with it."""
    half_width: StatisticalCurves


class PredictedCurves(Result):
    """The curves that the statistics of other trials and other people predict: the best answer to
    what the person does at this speed. The walk follows them as far as a body can.
    """

    curves: StatisticalCurves
    band: PredictionBand | None = Field(None)
    """Null where too few trials can be held out."""
