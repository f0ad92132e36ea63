"""Results as tidy tables, one row a value; loaded when somebody asks for one."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, COORDINATES, split_side

COLUMNS = ("side", "quantity", "percent", "value", "unit")
"""Columns of a tidy table, one row a value. `percent` is of the gait cycle, and NaN for what is not
a curve; a trial has `time`, in s, in its place."""

MOMENT, FORCE = "moment", "ground reaction"
"""Words that follow a curve's name in a table, so that it is not taken for an angle."""

NamedCurve = tuple[str, str, Array]
"""Name with the suffix of its side, unit, and values (n,)."""

DEGREES: Final[float] = float(np.degrees(1.0))


def of_kind(name: str, kind: str) -> str:
    """`"knee_angle moment_r"` of `"knee_angle_r"` and `"moment"`; the name of no kind stays."""
    side, quantity = split_side(name)
    return f"{quantity} {kind}{name[-2:] if side else ''}" if kind else name


def angle_curves(positions: Array, names: Sequence[str] = ACTUATED) -> list[NamedCurve]:
    """Name, unit and values of the joint angles `names`; `positions` are (T, 31), rad."""
    return [(n, "deg", DEGREES * positions[:, COORDINATES.index(n)]) for n in names]


def moment_curves(moments: Array) -> list[NamedCurve]:
    """Name, unit and values of joint moments, (T, 25) Nm in the order of `ACTUATED`."""
    named = zip(ACTUATED, moments.T, strict=True)
    return [(of_kind(name, MOMENT), "Nm", values) for name, values in named]


def curve_frame(
    curves: Iterable[NamedCurve], *, axis: str = "percent", at: Array | None = None
) -> pd.DataFrame:
    """Tidy table of `curves`, each a name with its side's suffix, a unit and values (n,), over what
    is named `axis` and has the values `at` (n,), 0 to 100 % when not given.
    """
    parts = []
    for name, unit, values in curves:
        side, quantity = split_side(name)
        over = np.linspace(0.0, 100.0, len(values)) if at is None else at
        parts.append(
            pd.DataFrame(
                {"side": side, "quantity": quantity, axis: over, "value": values, "unit": unit}
            )
        )
    return pd.concat(parts, ignore_index=True)


def sourced_frame(sources: Mapping[str, Iterable[NamedCurve]]) -> pd.DataFrame:
    """Tidy table of the curves of several `sources`, with a column `source`."""
    parts = [curve_frame(curves).assign(source=name) for name, curves in sources.items()]
    return pd.concat(parts, ignore_index=True)


def value_frame(rows: Iterable[tuple[str, str, float | None, str]]) -> pd.DataFrame:
    """Tidy table of single values; `rows` are of side, quantity, value and unit."""
    return pd.DataFrame(
        [(side, quantity, np.nan, value, unit) for side, quantity, value, unit in rows],
        columns=list(COLUMNS),
    )


def ranges(frame: pd.DataFrame) -> pd.DataFrame:
    """Lowest and highest value of each quantity and side of a tidy `frame`."""
    grouped = frame.groupby(["quantity", "side", "unit"], sort=False)["value"]
    table = grouped.agg(["min", "max"]).reset_index()
    return table.rename(columns={"min": "lowest", "max": "highest"})
