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
from gaitval.metrics.results import Metrics, PlacedFoot, PushRecovery, StoredPushes

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


def of_run(metrics: Metrics, pushes: StoredPushes | None) -> Tables:
    """Tables of the figures of a run with the results `metrics`, by the names of the figures, and
    of its `pushes`, if there are any.
    """
    tables = {}
    if metrics.push_recovery is not None:
        tables["stability"] = _stability(metrics.push_recovery)
    if pushes is not None:
        tables["foot_placement"] = _placed(pushes.placed)
    return tables


def compared_name(metrics: Metrics) -> str:
    """What columns of the curves that a walk is compared with end with: nobody recorded a predicted
    one.
    """
    return "record" if metrics.is_recorded_at_all else "predicted"


def _stability(pushes: PushRecovery) -> str:
    rows = [
        (phase, direction, force)
        for phase, forces in zip(pushes.phases, pushes.largest, strict=True)
        for direction, force in zip(pushes.directions, forces, strict=True)
    ]
    return _of_rows(("phase", "direction_deg", "largest_survived_n"), rows)


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
