"""Rows of the report's tables of curves, plates, power and parts of the moments."""

from collections.abc import Mapping, Sequence
from typing import Final, cast

from gaitval.coordinates import ACTUATED, SIDES, split_side
from gaitval.gait.cycle_curves import FORCES, JOINT_ANGLES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.metrics.baselines import group_curves, group_rows, skill
from gaitval.metrics.comparison import rmse_of
from gaitval.metrics.curve_results import Kind
from gaitval.metrics.origin import curve_origin
from gaitval.metrics.results import Metrics, TorqueShares
from gaitval.metrics.verdict_rows import ENDURANCE
from gaitval.metrics.walk_quantities import of_record, of_walk
from gaitval.quantities import QUANTITIES, Found, Quantity
from gaitval.reporting.figures import NAMES

_Row = dict[str, object]
"""A row of a table, for the template."""

Values = Mapping[str, float | None]

CURVES: Final[tuple[tuple[Kind, tuple[str, ...], int], ...]] = (
    ("angles", (*JOINT_ANGLES, *PELVIS_ANGLES), 1),
    ("moments", JOINT_MOMENTS, 2),
    ("forces", FORCES, 1),
)
"""Kind, names and digits of the curves, as they are listed."""


def error_table(metrics: Metrics) -> list[_Row]:
    """Rows of every curve and side in `metrics`: RMSE before and after identification and
    correction, that of a prediction without a model, and the skill against it.
    """
    origins, nominal = metrics.origins, metrics.walks.nominal
    tables: list[_Row] = []
    for kind, names, digits in CURVES:
        rows = []
        for name in names:
            for side in SIDES:
                key = f"{name}_{side[0]}"
                error = metrics.walk.errors.of(kind)[key]
                guesses = [each.rmse.of(kind)[key] for each in metrics.predictions[:1]]
                guess = guesses[0] if guesses else None
                rows.append(
                    {
                        "name": NAMES[name],
                        "side": side,
                        "error": error,
                        "before": nominal.errors.of(kind)[key],
                        "guess": guess,
                        "origin": curve_origin(kind, key, origins),
                        "skill": skill(rmse_of(error), guess),
                    }
                )
        tables.append(
            {"kind": kind, "unit": metrics.units.of(kind), "digits": digits, "rows": rows}
        )
    return tables


def as_measured(metrics: Metrics) -> list[_Row] | None:
    """Rows of the moments and forces in `metrics` whose recorded curve the correction of the plates
    changes: RMSE against it, and against the record as measured.
    """
    walk = metrics.walk
    if walk.errors_as_measured is None:
        return None
    measured = {**walk.errors_as_measured.moments, **walk.errors_as_measured.forces}
    rows: list[_Row] = []
    for kind, names, digits in CURVES[1:]:
        for name in names:
            for side in SIDES:
                key = f"{name}_{side[0]}"
                rows.append(
                    {
                        "name": NAMES[name],
                        "unit": metrics.units.of(kind),
                        "side": side,
                        "digits": 3 if kind == "moments" else digits,
                        "corrected": rmse_of(walk.errors.of(kind)[key]),
                        "measured": measured[key],
                    }
                )
    return rows


_HEAD: Final = 3
"""Rows that the head of a table and the space below it are as high as."""


def figure_tables(metrics: Metrics) -> list[_Row]:
    """The tables of figures of every quantity in `metrics`, of walk and record. Figures of a curve
    are found anew, because an older file may have defined them otherwise.
    """
    return [
        table
        for each in QUANTITIES
        for recorded, walked in [(of_record(metrics.record, each), of_walk(metrics.walk, each))]
        if recorded is not None or walked is not None
        for table in tables_of(each, recorded, walked)
    ]


def in_halves(tables: Sequence[_Row]) -> tuple[Sequence[_Row], Sequence[_Row]]:
    """`tables` for two columns of a page, in their order and as equally long as can be; the first
    is the longer one where they cannot.
    """
    lengths = [_HEAD + len(cast("list[_Row]", each["rows"])) for each in tables]
    at = min(range(len(tables) + 1), key=lambda k: (abs(sum(lengths[:k]) - sum(lengths[k:])), -k))
    return tables[:at], tables[at:]


def tables_of(quantity: Quantity, recorded: Found | None, walked: Found | None) -> list[_Row]:
    """The tables of figures of a `quantity`: title, unit, what stands for a missing figure, columns
    (the sides, or the body), and rows by column of what was `recorded` and `walked`.
    """
    figures = [{} if found is None else found.figures for found in (recorded, walked)]
    return [
        {
            "title": table.title,
            "unit": table.unit,
            "missing": table.missing,
            "columns": table.columns,
            "rows": [
                {
                    "name": label,
                    "unit": table.unit,
                    "digits": table.digits,
                    "sides": {
                        column: {
                            "recorded": table.figure(figures[0], kind, name, column),
                            "walked": table.figure(figures[1], kind, name, column),
                        }
                        for column in table.columns
                    },
                }
                for label, kind, name in table.rows
            ],
        }
        for table in quantity.tables
    ]


def torque_shares(values: TorqueShares | None) -> list[_Row] | None:
    """Rows of each coordinate and side with the parts of its moment in `values`."""
    if values is None:
        return None
    return [
        {"name": name.replace("_", " "), "side": side, "parts": values[joint]}
        for joint in ACTUATED
        for side, name in (split_side(joint),)
    ]


def second_engine(metrics: Metrics) -> _Row | None:
    """The second-engine check in `metrics`, with the largest difference of each kind."""
    found = metrics.second_engine
    if found is None:
        return None
    there = {(row.measure, row.target): row.value for row in found.measures}
    rows: list[_Row] = []
    for measure, name, unit, digits in (
        ("angle_rmse", "Angle", "deg", 2),
        ("moment_rmse", "Moment", "Nm/kg", 3),
        ("force_rmse", "Ground reaction", "% BW", 2),
    ):
        both = {
            row.target: (row.value, other)
            for row in metrics.measures
            if row.measure == measure
            and row.value is not None
            and (other := there[measure, row.target]) is not None
        }
        if not both:
            continue
        worst = max(both, key=lambda target: abs(both[target][1] - both[target][0]))
        side, curve = split_side(worst)
        rows.append(
            {
                "name": name,
                "target": f"{NAMES[curve]}, {side}",
                "here": both[worst][0],
                "there": both[worst][1],
                "unit": unit,
                "digits": digits,
            }
        )
    counted = [
        row.reached
        for row in metrics.tolerances
        if (row.measure, row.target) in there
        and row.measure not in ENDURANCE
        and row.role == "acceptance"
        and row.reached is not None
    ]
    return {"found": found, "rows": rows, "here": sum(counted)}


def distances(metrics: Metrics) -> _Row | None:
    """The walk's distance in `metrics` from its prediction by groups of curves, beside the errors
    of predictions of held-out trials; None where something was recorded.
    """
    if metrics.is_recorded_at_all:
        return None
    errors = metrics.prediction_errors
    held_out = {row.group: row for row in errors.groups} if errors else {}
    return {
        "errors": errors,
        "rows": [
            {
                "group": row.group,
                "unit": row.unit,
                "digits": 3 if row.unit == "Nm/kg" else 1,
                "walked": row.walked,
                "held_out": held_out.get(row.group),
            }
            for row in group_rows(metrics)
        ],
    }


def known_quantities(metrics: Metrics) -> _Row:
    """What the model knew in `metrics`; errors beside those of predictions without a model."""
    known = [name for name, read_by in metrics.known.items() if read_by]
    rows = [
        {**row._asdict(), "skills": row.skills(), "digits": 3 if row.unit == "Nm/kg" else 1}
        for row in group_rows(metrics)
    ]
    return {
        "how": "predicted" if not known else "fitted" if "forces" in known else "partly",
        "kinetics_recorded": "forces" in metrics.recorded or not metrics.is_recorded_at_all,
        "nowhere": not metrics.is_recorded_at_all,
        "guesses": [prediction.name for prediction in metrics.predictions],
        "rows": rows,
    }


def unseen(metrics: Metrics) -> list[_Row]:
    """Held-out trials at the same speed in `metrics`, by groups of curves."""
    errors = metrics.walk.errors
    tables: list[_Row] = []
    for trial in metrics.unseen:
        groups = []
        for name, (kind, every, unit) in group_curves(metrics).items():
            between, rmse = trial.between.of(kind), trial.rmse.of(kind)
            curves = [curve for curve in every if between[curve] is not None] or every
            own = [rmse_of(errors.of(kind)[curve]) for curve in curves]
            known_mean, unknown_mean = _mean(own), _mean([rmse[curve] for curve in curves])
            alike = trial.multiple_correlation.of(kind)
            groups.append(
                {
                    "name": name,
                    "unit": unit,
                    "digits": 3 if unit == "Nm/kg" else 1,
                    "known": known_mean,
                    "held_out": unknown_mean,
                    "ratio": unknown_mean / known_mean if known_mean and unknown_mean else None,
                    "between": _mean([between[curve] for curve in curves]),
                    "correlation": _mean([alike[curve] for curve in curves]),
                }
            )
        tables.append({"trial": trial.trial, "speed": trial.speed, "groups": groups})
    return tables


def _mean(values: Sequence[float | None]) -> float | None:
    found = [value for value in values if value is not None]
    return sum(found) / len(found) if found and len(found) == len(values) else None
