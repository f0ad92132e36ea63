"""Rows of the report's tables of curves, plates, engines and parts of the moments."""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from gaitval.coordinates import SIDES, Side
from gaitval.gait.cycle_curves import FORCES, JOINT_ANGLES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.gait.record import Origin
from gaitval.metrics.baselines import GroupRow, group_curves, group_rows, skill
from gaitval.metrics.comparison import rmse_of
from gaitval.metrics.curve_results import CurveError, Kind
from gaitval.metrics.origin import curve_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.walk_quantities import of_record, of_walk
from gaitval.metrics.whole_error import AS_MEASURED, OWN_HIPS
from gaitval.quantities import QUANTITIES, Found, Quantity
from gaitval.quantities.quantity import Figures, FigureTable
from gaitval.reporting.grids import curve_name, panel_name

CURVES: Final[tuple[tuple[Kind, tuple[str, ...], int], ...]] = (
    ("angles", (*JOINT_ANGLES, *PELVIS_ANGLES), 1),
    ("moments", JOINT_MOMENTS, 2),
    ("forces", FORCES, 1),
)
"""Kind, names and digits of the curves, as they are listed."""


class CurveFinding(NamedTuple):
    """What a heading says of the recorded curves of a kind, both sides, in the unit of
    `Metrics.units`.

    Attributes
    ----------
    mean : of their RMSE.
    worst, name, side : the largest RMSE, and the curve that has it.
    """

    mean: float
    worst: float
    name: str
    side: Side


def findings(
    metrics: Metrics, extensor_positive: bool = False
) -> Mapping[str, CurveFinding | None]:
    """By kind; None where nothing was recorded or nothing walked. Moments are called as they are
    drawn.
    """
    found: dict[str, CurveFinding | None] = {}
    for kind, names, _ in CURVES:
        errors = [
            (value, curve_name(kind, name, extensor_positive), side)
            for name in names
            for side in SIDES
            if curve_origin(kind, key := f"{name}_{side[0]}", metrics.origins) == "recorded"
            and (value := rmse_of(metrics.walk.errors.of(kind)[key])) is not None
        ]
        mean = sum(value for value, *_ in errors) / max(1, len(errors))
        found[kind] = CurveFinding(mean, *max(errors)) if errors else None
    return found


class ErrorRow(NamedTuple):
    """A curve of a side: its error, that from the curve `as_measured` and about the walker's
    `own_hips` (None of other curves), the RMSE of the best prediction without a model, and the
    skill against that.
    """

    name: str
    side: Side
    error: CurveError | None
    as_measured: float | None
    own_hips: float | None
    guess: float | None
    origin: Origin
    skill: float | None


class ErrorTable(NamedTuple):
    """The curves of a kind."""

    kind: Kind
    digits: int
    rows: Sequence[ErrorRow]


def error_tables(metrics: Metrics, extensor_positive: bool = False) -> list[ErrorTable]:
    """Every curve and side in `metrics`; moments are called as they are drawn."""
    uncorrected = {(each.measure, each.target): each.value for each in metrics.measures}

    def row(kind: Kind, name: str, side: Side) -> ErrorRow:
        key = f"{name}_{side[0]}"
        error = metrics.walk.errors.of(kind)[key]
        guess = metrics.lights.of(kind)[key].guess_error
        return ErrorRow(
            panel_name(kind, name, extensor_positive),
            side,
            error,
            uncorrected.get((AS_MEASURED.get(kind, ""), key)),
            uncorrected.get((OWN_HIPS, key)) if kind == "moments" else None,
            guess,
            curve_origin(kind, key, metrics.origins),
            skill(rmse_of(error), guess),
        )

    return [
        ErrorTable(kind, digits, [row(kind, name, side) for name in names for side in SIDES])
        for kind, names, digits in CURVES
    ]


class ShownFigures(NamedTuple):
    """A table of figures of a quantity, and those of record and walk."""

    table: FigureTable
    recorded: Figures
    walked: Figures


def figure_tables(metrics: Metrics) -> list[ShownFigures]:
    """The tables of figures of every shown quantity in `metrics` but those of muscles, which were
    not recorded, of walk and record. Figures of a curve are found anew, because an older file may
    have defined them otherwise.
    """
    return [
        table
        for each in QUANTITIES
        if each.shown != "nothing" and each.of_muscles is None
        for recorded, walked in [(of_record(metrics.record, each), of_walk(metrics.walk, each))]
        if recorded is not None or walked is not None
        for table in tables_of(each, recorded, walked)
    ]


def tables_of(
    quantity: Quantity, recorded: Found | None, walked: Found | None
) -> list[ShownFigures]:
    """The tables of figures of a `quantity`, of what was `recorded` and `walked`."""
    both = [{} if found is None else found.figures for found in (recorded, walked)]
    return [ShownFigures(table, *both) for table in quantity.tables]


def in_halves(
    tables: Sequence[ShownFigures],
) -> tuple[Sequence[ShownFigures], Sequence[ShownFigures]]:
    """`tables` for two columns of a page, in their order and as equally long as can be; the first
    is the longer one where they cannot.
    """
    lengths = [3 + len(each.table.rows) for each in tables]  # the head is as high as three rows
    at = min(range(len(tables) + 1), key=lambda k: (abs(sum(lengths[:k]) - sum(lengths[k:])), -k))
    return tables[:at], tables[at:]


class Known(NamedTuple):
    """What the model knew of the record, and errors beside those of predictions without a model.

    Attributes
    ----------
    how : "fitted", "partly" fitted, or "predicted".
    kinetics_recorded : whether moments and forces are those of a record, if there is one.
    guesses : names of the predictions.
    """

    how: str
    kinetics_recorded: bool
    guesses: Sequence[str]
    rows: Sequence[GroupRow]


def known_quantities(metrics: Metrics) -> Known:
    """Of the record in `metrics`."""
    known = [name for name, read_by in metrics.known.items() if read_by]
    return Known(
        "predicted" if not known else "fitted" if "forces" in known else "partly",
        "forces" in metrics.recorded or not metrics.is_recorded_at_all,
        [prediction.name for prediction in metrics.predictions],
        group_rows(metrics),
    )


class UnseenGroup(NamedTuple):
    """Mean errors of a group of curves: of the walk from the known and the held-out trial, and of
    the trials from each other, with their multiple correlation.
    """

    name: str
    unit: str
    known: float | None
    held_out: float | None
    between: float | None
    correlation: float | None

    @property
    def ratio(self) -> float | None:
        """Held-out over known."""
        return self.held_out / self.known if self.known and self.held_out else None


class UnseenTrial(NamedTuple):
    """A held-out trial at the same speed, m/s."""

    trial: str
    speed: float
    groups: Sequence[UnseenGroup]


def unseen(metrics: Metrics) -> list[UnseenTrial]:
    """Held-out trials in `metrics`, by groups of curves."""
    errors = metrics.walk.errors
    tables = []
    for trial in metrics.unseen:
        groups = []
        for name, (kind, every, unit) in group_curves(metrics).items():
            between, rmse = trial.between.of(kind), trial.rmse.of(kind)
            curves = [curve for curve in every if between[curve] is not None] or every
            alike = trial.multiple_correlation.of(kind)
            means = (
                [rmse_of(errors.of(kind)[curve]) for curve in curves],
                *([each[curve] for curve in curves] for each in (rmse, between, alike)),
            )
            groups.append(UnseenGroup(name, unit, *map(_mean, means)))
        tables.append(UnseenTrial(trial.trial, trial.speed, groups))
    return tables


def _mean(values: Sequence[float | None]) -> float | None:
    found = [value for value in values if value is not None]
    return sum(found) / len(found) if found and len(found) == len(values) else None
