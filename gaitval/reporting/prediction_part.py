"""What was predicted for a speed without a model: figure, table and numbers of a report."""

from functools import partial
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import with_unit
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.baselines import group_curves
from gaitval.metrics.curve_results import KINDS, PredictedCurves
from gaitval.metrics.origin import curve_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array
from gaitval.reporting import grids
from gaitval.reporting.figure_data import Column, Tables, table
from gaitval.reporting.figures import PERCENT
from gaitval.reporting.grids import DrawnCurve, Panel
from gaitval.reporting.page import Draw

PANELS: Final = (
    *grids.SAGITTAL,
    ("angles/hip_adduction", "angles/hip_rotation", "moments/hip_adduction"),
    *grids.FORCES,
)


class PredictedRow(NamedTuple):
    """A group of curves: how far walk and prediction are from the record, if there is one, the mean
    half width of the band, and the share of points of walk and record that it contains.
    """

    group: str
    unit: str
    prediction: float | None
    walk: float | None
    walk_from_prediction: float | None
    half_width: float | None
    record_inside: float | None
    walk_inside: float | None


def predicted_rows(metrics: Metrics) -> list[PredictedRow]:
    """Of each group of the predicted curves in `metrics`; none of a walk that is no prediction."""
    found = metrics.predicted
    return [] if found is None else [_row(metrics, found, each) for each in group_curves(metrics)]


def figure(metrics: Metrics) -> tuple[dict[str, Draw], Tables]:
    """What draws the predicted curves in `metrics`, and their numbers, by name; none of a walk that
    is no prediction.
    """
    found = metrics.predicted
    if found is None:
        return {}, {}
    draw = partial(
        grids.grid,
        [[_panel(metrics, found, name) for name in row] for row in PANELS],
        height=1.35,
        figure_name="prediction",
        words=("record" if metrics.is_recorded_at_all else "walk", "prediction"),
        spread=_band_label(found),
        linked=False,
    )
    return {"prediction": draw}, {"prediction": _numbers(found)}


def _band_label(found: PredictedCurves) -> str:
    return "" if found.band is None else f"{100 * found.band.share:.0f} % band of the prediction"


def _panel(metrics: Metrics, found: PredictedCurves, name: str) -> Panel:
    kind_name, _, curve = name.partition("/")
    kind = next(each for each in KINDS if each == kind_name)
    curves = []
    for side in SIDES:
        key = f"{curve}_{side[0]}"
        beside = _beside(metrics, name, key)
        if beside is not None:
            curves.append(DrawnCurve(side, beside, which="record"))
        width = None if found.band is None else array(found.band.half_width.of(kind)[key])
        curves.append(DrawnCurve(side, array(found.curves.of(kind)[key]), width))
    return Panel(name, tuple(curves))


def _beside(metrics: Metrics, name: str, key: str) -> Array | None:
    """The record, or where there is none the walk."""
    kind = next(each for each in KINDS if each == name.partition("/")[0])
    if curve_origin(kind, key, metrics.origins) == "recorded":
        return array(metrics.record.curves.of(kind)[key])
    walked = metrics.walk.curves.of(kind)[key].mean
    return None if metrics.is_recorded_at_all or walked is None else array(walked)


def _row(metrics: Metrics, found: PredictedCurves, group: str) -> PredictedRow:
    kind, names, unit = group_curves(metrics)[group]
    predicted = {name: array(found.curves.of(kind)[name]) for name in names}
    recorded = {
        name: array(metrics.record.curves.of(kind)[name])
        for name in names
        if curve_origin(kind, name, metrics.origins) == "recorded"
    }
    walked = {
        name: array(mean)
        for name in names
        if (mean := metrics.walk.curves.of(kind)[name].mean) is not None
    }
    widths = {}
    if found.band is not None:
        widths = {name: array(found.band.half_width.of(kind)[name]) for name in names}
    shown_widths = [width[on(kind, predicted[name])] for name, width in widths.items()]
    return PredictedRow(
        group,
        unit,
        _rmse(predicted, recorded),
        _rmse(walked, recorded),
        _rmse(walked, predicted),
        float(np.mean(np.concatenate(shown_widths))) if shown_widths else None,
        inside(kind, predicted, recorded, widths),
        inside(kind, predicted, walked, widths),
    )


def _rmse(one: dict[str, Array], other: dict[str, Array]) -> float | None:
    both = [one[name] - other[name] for name in one if name in other]
    return float(np.mean([np.sqrt(np.mean(each**2)) for each in both])) if both else None


def on(kind: str, curve: Array) -> Array:
    """(n,) where a predicted `curve` of a `kind` says something: no force in swing."""
    return np.asarray(curve != 0.0 if kind == "forces" else np.isfinite(curve))


def inside(
    kind: str, predicted: dict[str, Array], found: dict[str, Array], widths: dict[str, Array]
) -> float | None:
    """Share of the points of the curves `found` that are within `widths` of the `predicted` ones of
    the same name and `kind`; None without any.
    """
    points = [
        (np.abs(found[name] - predicted[name]) <= width)[on(kind, predicted[name])]
        for name, width in widths.items()
        if name in found
    ]
    return float(np.mean(np.concatenate(points))) if points else None


def _numbers(found: PredictedCurves) -> str:
    """Every predicted curve with the ends of its band, as CSV."""
    columns: dict[str, Column] = {"percent": PERCENT}
    for kind, name, curve in found.curves.items():
        mean, unit = array(curve), grids.TABLE_UNITS[kind]
        columns[with_unit(f"{kind}_{name}_predicted", unit)] = mean
        if found.band is not None:
            width = array(found.band.half_width.of(kind)[name])
            columns[with_unit(f"{kind}_{name}_band_low", unit)] = mean - width
            columns[with_unit(f"{kind}_{name}_band_high", unit)] = mean + width
    return table(columns)
