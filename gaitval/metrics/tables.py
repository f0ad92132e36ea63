"""Metrics as their title, a small table and a tidy one (`display.Displayed`)."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from gaitval._internal.text.frames import FORCE, MOMENT, NamedCurve, of_kind, sourced_frame
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.curve_results import Kind, Kinds, MeanCurve
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.typed import Curve
from gaitval.quantities import BY_NAME, Found

AnyCurves = Kinds[MeanCurve] | Kinds[Curve]
"""Simulated, or recorded."""


def limits_met(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Each limit that decides, and how many of its measures in `verdicts` meet it."""
    met: dict[tuple[str, str, str], list[bool]] = {}
    for row in verdicts:
        if row.role == "acceptance":
            limit = f"{row.limit.replace('_', ' ')} {row.tolerance:g}"
            met.setdefault((row.title, limit, row.unit), []).append(row.passed)
    return pd.DataFrame(
        [(*limit, f"{sum(passed)} of {len(passed)}") for limit, passed in met.items()],
        columns=["quantity", "limit", "unit", "met"],
    )


def mean_curves(
    curves: Mapping[str, AnyCurves],
    units: Mapping[Kind, str],
    quantities: Mapping[str, Mapping[str, Found]],
) -> pd.DataFrame:
    """Tidy table of `curves`, by whose they are, which are in `units`, and of the `quantities` of
    the same.
    """
    return sourced_frame(
        {
            source: [*_named(each, units), *_of_quantities(quantities[source])]
            for source, each in curves.items()
        }
    )


def _of_quantities(found: Mapping[str, Found]) -> Iterator[NamedCurve]:
    for kind, quantity in found.items():
        for name, curve in quantity.curves.items():
            yield of_kind(name, kind.replace("_", " ")), BY_NAME[kind].unit, curve


def _named(curves: AnyCurves, units: Mapping[Kind, str]) -> Iterator[NamedCurve]:
    words: dict[Kind, str] = {"angles": "", "moments": MOMENT, "forces": FORCE}
    for kind, name, curve in curves.items():
        values = curve.mean if isinstance(curve, MeanCurve) else curve
        shown = np.full(SAMPLES, np.nan) if values is None else np.array(values, dtype=float)
        yield of_kind(name, words[kind]), units[kind], shown
