"""The numbers behind each figure, as CSV, to draw again or compute with.

Columns have the units of the figure; an empty field is a value that was not measured.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.results import Metrics, PlacedFoot, PushRecovery, PushTrace, StoredPushes
from gaitval.metrics.whole_body import AXES

FOLDER: Final = "figures"
"""Folder of the tables, beside the page."""

_PERCENT: Final = np.arange(101)

Column = Array | NDArray[np.int64] | Sequence[float | None] | Sequence[str] | None


def table(columns: Mapping[str, Column]) -> str:
    """`columns` of equal length as CSV; one that is None is left out."""
    kept = {name: _fields(values) for name, values in columns.items() if values is not None}
    return csv_text([kept, *zip(*kept.values(), strict=True)])


def _fields(values: Column) -> list[str]:
    # Python's numbers are written five times as fast as NumPy's
    plain = values.tolist() if isinstance(values, np.ndarray) else values or ()
    return [_field(value) for value in plain]


def _field(value: str | float | None) -> str:
    if isinstance(value, str):
        return value
    return "" if value is None or not math.isfinite(value) else f"{value:.6g}"


Tables = dict[str, str]
"""Tables as CSV by the names of their figures."""


def write_tables(folder: Path, tables: Mapping[str, str]) -> None:
    """Write each of `tables` to `folder`/`FOLDER`/NAME.csv."""
    for name, text in tables.items():
        write_text(folder / FOLDER / f"{name}.csv", text)


def of_run(
    metrics: Metrics, training: Mapping[str, Array] | None, pushes: StoredPushes | None
) -> Tables:
    """Tables of the figures of a run with the results `metrics`, by the names of the figures: from
    `training`, the columns of the learning curve, and of the walks in `pushes`, if there are any.
    """
    tables = {"pressure": _pressure(metrics), "centre_of_mass": _centre_of_mass(metrics)}
    if metrics.push_recovery is not None:
        tables["stability"] = _stability(metrics.push_recovery)
    if pushes is not None:
        tables["push_velocity"] = _push_velocity(pushes.traces)
        tables["foot_placement"] = _placed(pushes.placed)
    if training is not None:
        tables["learning"] = table(training)
    return tables


def compared_name(metrics: Metrics) -> str:
    """What columns of the curves that a walk is compared with end with: nobody recorded a predicted
    one.
    """
    return "record" if metrics.is_recorded_at_all else "predicted"


def _pressure(metrics: Metrics) -> str:
    contact = metrics.walk.foot_contact
    columns: dict[str, Column] = {"percent_of_stance": _PERCENT}
    for side in SIDES:
        path = contact.of(side).path
        # in the order of the names, as files have it
        for way, curve in (("across", path.across), ("along", path.along)):
            columns[f"{way}_{side}_mean_percent_foot"] = curve.mean
            columns[f"{way}_{side}_sd_percent_foot"] = curve.sd
    return table(columns)


def _centre_of_mass(metrics: Metrics) -> str:
    """In mm, as drawn."""
    walked = metrics.walk.centre_of_mass
    columns: dict[str, Column] = {"percent": _PERCENT}
    recorded = compared_name(metrics), metrics.record.centre_of_mass
    for name, path in (recorded, ("mean", walked)):
        # without a walk there are no columns, hence not strict
        for axis, values in zip(AXES, np.array(path).T if path else (), strict=False):
            columns[f"{axis}_{name}_mm"] = 1e3 * values
    return table(columns)


def _stability(pushes: PushRecovery) -> str:
    rows = [
        (phase, direction, force)
        for phase, forces in zip(pushes.phases, pushes.largest, strict=True)
        for direction, force in zip(pushes.directions, forces, strict=True)
    ]
    return _of_rows(("phase", "direction_deg", "largest_survived_n"), rows)


def _push_velocity(traces: Sequence[PushTrace]) -> str:
    """As simulated, m/s; the figure shows its change from the cycle before the push."""
    rows = [
        (trace.phase, trace.direction, cycle, *velocity[:2])
        for trace in traces
        for cycle, velocity in zip(trace.cycles, trace.velocity, strict=True)
    ]
    names = ("phase", "direction_deg", "cycles_since_push", "forward_m_s", "left_m_s")
    return _of_rows(names, rows)


def _placed(placed: Sequence[PlacedFoot]) -> str:
    """Pushes that were followed by a step, changes to the left, m."""
    rows = [
        (
            *(each.phase, each.direction, each.force, float(each.side == "left"), each.lead),
            *(each.extrapolated, each.foot),
            math.nan if each.pendulum is None else each.pendulum,
        )
        for each in placed
        if each.lead is not None and each.foot is not None and each.extrapolated is not None
    ]
    names = ("phase", "direction_deg", "force_n", "left_foot", "lead_s", "extrapolated_m", "foot_m")
    return _of_rows((*names, "pendulum_m"), rows)


def _of_rows(names: Sequence[str], rows: Sequence[Sequence[float]]) -> str:
    """Of a walker that fell there are none."""
    return table(dict(zip(names, [*zip(*rows, strict=True)] or [()] * len(names), strict=True)))
