"""Metrics as their title, a small table and a tidy one (`display.Displayed`)."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from gaitval.frames import FORCE, MOMENT, NamedCurve, of_kind, sourced_frame
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.record_results import KINDS, Kind, Kinds
from gaitval.metrics.results import Metrics
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.typed import Curve
from gaitval.metrics.walk_results import MeanCurve

AnyCurves = Kinds[MeanCurve] | Kinds[Curve]
"""Simulated, or recorded."""


def title(metrics: Metrics) -> str:
    """Whose `metrics`, and how many limits are met, or that nothing was recorded to judge by."""
    counts, name = metrics.summary, metrics.subject.identifier
    if not metrics.is_recorded_at_all:
        return f"Study of {name}: nothing was recorded at this speed, accuracy is not judged"
    return f"Study of {name}: {counts.accepted} of {counts.accepted + counts.refused} limits met"


def overview(metrics: Metrics) -> pd.DataFrame:
    """Each limit that decides the verdict, and how many of its measures in `metrics` meet it."""
    return limits_met(metrics.tolerances)


def to_frame(metrics: Metrics) -> pd.DataFrame:
    """Mean curves of walk and record in `metrics` at 0, 1, … 100 % of each side's gait cycle:
    joint angles (deg), joint moments (Nm/kg), ground reaction (% of body weight). A column
    `source` says whose each row is.
    """
    name = metrics.subject.identifier
    other = "record of" if metrics.is_recorded_at_all else "prediction for"
    return mean_curves(
        {f"walk of {name}": metrics.walk.curves, f"the {other} {name}": metrics.record.curves},
        {kind: metrics.units.of(kind) for kind in KINDS},
    )


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


def mean_curves(curves: Mapping[str, AnyCurves], units: Mapping[Kind, str]) -> pd.DataFrame:
    """Tidy table of `curves`, by whose they are, which are in `units`."""
    return sourced_frame({source: _named(each, units) for source, each in curves.items()})


def _named(curves: AnyCurves, units: Mapping[Kind, str]) -> Iterator[NamedCurve]:
    words: dict[Kind, str] = {"angles": "", "moments": MOMENT, "forces": FORCE}
    for kind, name, curve in curves.items():
        values = curve.mean if isinstance(curve, MeanCurve) else curve
        shown = np.full(SAMPLES, np.nan) if values is None else np.array(values, dtype=float)
        yield of_kind(name, words[kind]), units[kind], shown
