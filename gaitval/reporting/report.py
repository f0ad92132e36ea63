"""The report of a run folder: one template, as self-contained HTML and as PDF."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import gaitval
from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_json
from gaitval.arrays import Array
from gaitval.configuration import Configuration, load_configuration
from gaitval.conventions import OWN
from gaitval.coordinates import split_side
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArtefactError
from gaitval.gait.filters import FACTOR
from gaitval.identification.body_report import Bar
from gaitval.learning_control.walked import ACCURACY, PREDICTED, Accuracies, Walked
from gaitval.metrics.curve_results import CURVE_UNITS, KINDS
from gaitval.metrics.origin import not_recorded
from gaitval.metrics.results import (
    METRICS,
    CorrectionResult,
    Determination,
    FoundParameters,
    Metrics,
    PushRecovery,
    StoredPushes,
    read_metrics,
)
from gaitval.metrics.tolerances import Role, Verdict
from gaitval.metrics.verdicts import (
    close_text,
    limit_verdicts,
    spread_text,
    target_text,
    unjudged_text,
    value_text,
)
from gaitval.policy.training_log import LEARNING_CURVES
from gaitval.prediction.slopes import is_changed
from gaitval.reference.adjustment import JOINTS, Adjustment
from gaitval.reporting import (
    balance_figure,
    body_bars,
    checklist,
    credibility,
    curve_statistics,
    figure_data,
    figures,
    prediction_part,
    run_grids,
    tables,
)
from gaitval.reporting.facts import measured_force
from gaitval.reporting.findings import findings
from gaitval.reporting.page import Draw, counted, write_page
from gaitval.reporting.replay import SCRIPTS, walk_pictures
from gaitval.reporting.sheet import sheet

TEMPLATE = "report.html.j2"
DETAILS: Final = {"report-details": "details.html.j2"}
"""What stands behind the report: where its limits are from, how the walk was made, files."""
FAILED_SHOWN = 6
"""Number of failed targets that the tolerance table names; all are in the table of errors."""


def within_text(row: Verdict, uncertainty: Mapping[str, float]) -> str:
    """That the error of a `row` is less than the record's `uncertainty` (half of a 90 % band)."""
    kind = row.measure.removesuffix("_rmse")
    factor = {"angle": 180.0 / np.pi, "moment": 1.0, "force": 100.0}.get(kind, 0.0)
    name = f"{kind}_{row.target}".replace("_vertical_", "_up_").replace("_medial_", "_left_")
    half = factor * uncertainty.get(name, 0.0)
    within = row.value is not None and 0.0 <= row.value < half  # other measures have none
    return f" (within the record's own uncertainty, ± {half:.2g})" if within else ""


def _failed_text(rows: Sequence[Verdict], uncertainty: Mapping[str, float]) -> str:
    """The failed targets with their values; only the first ones if there are many."""
    failed = [
        f"{target_text(row.target)}: "
        + ("not measured" if row.value is None else f"{row.value:.3g}")
        + within_text(row, uncertainty)
        for row in rows
        if not row.passed and row.target != "walk"
    ]
    more = len(failed) - FAILED_SHOWN
    return "; ".join(failed[:FAILED_SHOWN]) + (f"; and {more} more" if more > 0 else "")


def _tolerances(metrics: Metrics, role: Role, subject: Subject) -> list[tables._Row]:
    """One entry per tolerance, failed first: how many targets pass, and the worst one."""
    return [
        {
            **found.first.as_dict(),
            "limit_text": found.limit_text(),
            "goal_text": found.goal_text(),
            "passed": found.passed,
            "reached": all(row.reached for row in found.rows),
            "count": len(found.rows),
            "count_passed": len(found.rows) - len(found.failed),
            "count_failed": len(found.failed),
            "guess": found.guess,
            "state": found.state,
            "reason": found.reason_text(),
            "worst": found.value_text(),
            "worst_target": target_text(found.worst.target),
            "repeats": spread_text(found.worst),
            "close": [
                {
                    "target": target_text(row.target),
                    "value": value_text(row),
                    "repeats": spread_text(row),
                    "why": close_text(row),
                }
                for row in found.close
            ],
            "failed": _failed_text(found.rows, subject.uncertainty),
            "remedy": found.remedy,
        }
        for found in limit_verdicts(metrics, role)
    ]


def _correction(found: CorrectionResult | None, accuracies: Accuracies) -> tables._Row | None:
    """What the correction of the reference changes, in degrees, and its effect; errors weigh by
    `accuracies`.
    """
    if found is None:
        return None
    adjustment = Adjustment.from_dict(found.as_dict(), METRICS)
    changes = np.rad2deg(adjustment.angles(np.linspace(0.0, 1.0, 101))[0])
    rows: dict[str, list[dict[str, float]]] = {}
    for index, joint in enumerate(JOINTS):
        name = split_side(joint)[1].replace("_", " ")
        largest = float(np.abs(changes[:, index]).max())
        # the harmonic of order 0 is the mean change
        mean = math.degrees(adjustment.harmonics[index, 0])
        rows.setdefault(name, []).append({"mean": mean, "largest": largest})
    groups = [
        {
            "name": kind,
            "unit": CURVE_UNITS[kind],
            "fitted": fitted,
            "before": float(np.mean([row.before for row in group])),
            "after": float(np.mean([row.after for row in group])),
        }
        for kind in KINDS
        for fitted in (True, False)
        if (group := [row for row in found.curves if (row.kind, row.fitted) == (kind, fitted)])
    ]
    return {
        **dict(found),
        "after": Walked(
            np.empty(0), {(row.kind, row.curve): row.after for row in found.curves}, accuracies
        ).error(),
        "groups": groups,
        "rows": [{"name": name, "sides": sides} for name, sides in rows.items()],
    }


_AXIS = 3.0
"""Prior SDs that the drawing of a parameter reaches to on both sides."""


def _place(z: float) -> float:
    """Place on the axis of a parameter, %."""
    return 50.0 * (1.0 + min(1.0, max(-1.0, z / _AXIS)))


class ParameterRow(NamedTuple):
    """A parameter of mu, or a combination of them, with its places on an axis of prior SDs."""

    name: str
    prior_mean: float
    prior_sd: float
    mean: float
    sd: float
    used: float | None
    verdict: Determination
    prior_place: float = _place(-1.0)
    prior_width: float = _place(1.0) - _place(-1.0)

    @property
    def contraction(self) -> float:
        """Posterior SD over prior SD."""
        return self.sd / self.prior_sd

    @property
    def z(self) -> float:
        """Posterior mean less prior mean, prior SDs."""
        return (self.mean - self.prior_mean) / self.prior_sd

    @property
    def place(self) -> float:
        """Of the posterior mean."""
        return _place(self.z)

    @property
    def spread_place(self) -> float:
        """Where the mean ± SD begins."""
        return _place(self.z - self.contraction)

    @property
    def spread_width(self) -> float:
        """How far the mean ± SD reaches."""
        return _place(self.z + self.contraction) - self.spread_place


def _parameters(
    found: FoundParameters | None, bars: Sequence[tuple[str, float, float]] = ()
) -> list[ParameterRow] | None:
    """Rows of mu and of combinations, by the posterior's means in `found`. `bars` are name, mean
    and SD about what was expected, in prior SDs, where a parameter was not expected to be as
    scaled.
    """
    if found is None:
        return None
    moved = {name: mean for name, mean, _ in bars}

    def expected(i: int) -> float:
        shift = moved.get(found.names[i].replace("_", " "))
        if shift is None:
            return found.nominal[i]
        # what was stored has six digits: no -0.0000
        return round(found.posterior_mean[i] - shift * found.prior_standard_deviation[i], 6) + 0.0

    return [
        *(
            ParameterRow(
                name=name.replace("_", " "),
                prior_mean=expected(i),
                prior_sd=found.prior_standard_deviation[i],
                mean=found.posterior_mean[i],
                sd=found.standard_deviation[i],
                used=found.identified[i],
                verdict=found.verdicts[i],
            )
            for i, name in enumerate(found.names)
        ),
        *(
            ParameterRow(
                name=each.name.replace("_", " ") + ", m",
                prior_mean=0.0,
                prior_sd=each.prior_standard_deviation,
                mean=each.mean,
                sd=each.standard_deviation,
                used=None,
                verdict=each.verdict,
            )
            for each in found.combinations
        ),
    ]


def _correlated(found: FoundParameters | None) -> list[tuple[str, str, float]]:
    """Pairs of parameters that the record hardly distinguishes, with their correlation, the
    strongest first.
    """
    if found is None:
        return []
    names = [name.replace("_", " ") for name in found.names]
    pairs = [
        (names[i], names[j], found.correlation[i][j])
        for i in range(len(names))
        for j in range(i)
        if abs(found.correlation[i][j]) >= 0.4
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))[:6]


def _csv(path: Path, columns: Sequence[str], stage: str) -> list[dict[str, str]] | None:
    """Rows of a table of a `stage` with these `columns`, as text; None without such a file."""
    if not path.exists():
        return None
    found = file_gate.csv_rows(path, ArtefactError)
    rows = [{key: value or "" for key, value in row.items() if key} for _, row in found]
    missing = [name for name in columns if rows and name not in rows[0]]
    if missing:
        raise ArtefactError(
            f"{path}: the columns {', '.join(missing)} are missing. "
            f"Delete it and run `gaitval {stage}` again."
        )
    return rows


def _number_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _scaling(path: Path) -> list[tables._Row] | None:
    measured = ("right_m", "left_m", "length_m", "mass_kg", "factor")
    rows = _csv(path, ("segment", *measured, "source"), "scale")
    if rows is None:
        return None
    return [{**row, **{key: _number_or_none(row[key]) for key in measured}} for row in rows]


def _training(path: Path) -> dict[str, Array] | None:
    """Columns of the learning curve; None without the file or before its first row."""
    rows = _csv(path, LEARNING_CURVES, "train")
    if not rows:
        return None
    return {
        name: np.array([_number_or_none(row[name]) for row in rows], dtype=float)
        for name in LEARNING_CURVES
    }


def _pushes(path: Path) -> StoredPushes | None:
    """What is kept of pushes; None if none were tested."""
    if not path.exists():
        return None
    fix = "delete it and run `gaitval stage push SUBJECT` again"
    return StoredPushes.read(read_json(path), str(path), file="push.json", fix=fix)


def _push_rows(pushes: PushRecovery | None) -> list[tables._Row] | None:
    """Rows of the table of pushes, one per phase."""
    if pushes is None:
        return None
    rows: list[tables._Row] = []
    for phase, largest, survived in zip(
        pushes.phases, pushes.largest, pushes.survived, strict=True
    ):
        stood = dict(zip(pushes.criterion_directions, survived, strict=True))
        cells = [
            {
                "force": force,
                "fell": stood.get(direction) is False,
                "ceiling": force >= pushes.ceiling,
            }
            for direction, force in zip(pushes.directions, largest, strict=True)
        ]
        rows.append(
            {"phase": phase, "cells": cells, "stood": sum(survived), "count": len(survived)}
        )
    return rows


def _drawings(
    metrics: Metrics, training: Mapping[str, Array] | None, pushes: StoredPushes | None
) -> dict[str, Draw]:
    """What draws each figure but the grids. Figures contain no text from outside."""
    drawings: dict[str, Draw] = {
        "pressure": partial(figures.pressure_path, metrics),
        "centre_of_mass": partial(figures.centre_of_mass, metrics),
    }
    if metrics.push_recovery is not None:
        drawings["stability"] = partial(figures.stability_regions, metrics.push_recovery)
    if pushes is not None:
        drawings["push_velocity"] = partial(figures.push_velocity, pushes.traces)
    if pushes is not None and balance_figure.kept_distance(pushes.placed):
        draw = partial(balance_figure.foot_placement, {"": pushes.placed})
        drawings[balance_figure.NAME] = draw
    if training is not None:
        drawings["learning"] = partial(figures.learning, training)
    if (whole := metrics.curve_statistics) is not None:
        drawings["gait_profile"] = partial(curve_statistics.profile, whole.profiles)
    return drawings


def _walked(folder: Path) -> Subject:
    """The person, on the trial or at the speed that the walk is of."""
    subject = load_subject(str(folder / "subject.toml"))
    record = _configuration(folder).record
    if record.holdout:
        return subject.on_trial(record.holdout)
    speed = record.speed or subject.walking_speed_m_s
    return subject.model_copy(update={"walking_speed_m_s": speed})


def _context(folder: Path, convention: str = OWN) -> dict[str, Any]:
    """Everything that the template shows, read from the run folder, with the angles of figures
    counted by a `convention`.
    """
    subject = _walked(folder)
    metrics = read_metrics(folder / METRICS)
    training = _training(folder / "policy" / "training.csv")
    pushes = _pushes(folder / "push.json")
    walk, whole = metrics.walk, metrics.curve_statistics
    before = credibility.provenance_before(folder)
    strides = run_grids.strides_of(folder, metrics)
    drawn, data = run_grids.figures(metrics, subject, strides, convention)
    predicted, of_prediction, numbers = prediction_part.shown(metrics)
    drawn, data = drawn | of_prediction, data | numbers
    body, bars = None, list[Bar]()
    looked_for = "identification" in metrics.known["angles"]
    if looked_for and (folder / body_bars.FILE).is_file():
        body, bars, drawn["body"] = body_bars.shown(folder)
    shared = body is not None and body["method"] == "shared"  # the table is of the bars' posterior
    return {
        "subject": subject,
        "metrics": metrics,
        "method": metrics.method,
        "walk": walk,
        "nominal": metrics.walks.nominal,
        "identified": metrics.final == "identified",
        "identification": metrics.identification,
        "determined": bool(metrics.identification and metrics.identification.determined),
        "findings": findings(metrics),
        "filter_factor": FACTOR,
        "acceptance": _tolerances(metrics, "acceptance", subject),
        "context_tolerances": _tolerances(metrics, "context", subject),
        "prediction": next(iter(metrics.predictions), None),
        "torque_shares": tables.torque_shares(metrics.torque_shares),
        "judged": metrics.is_recorded_at_all,
        "ground": (ground := _configuration(folder).record),
        "changed": is_changed(ground),
        "unjudged": unjudged_text(metrics.origins).strip(),
        "distances": tables.distances(metrics),
        "predicted_curves": predicted,
        "known": tables.known_quantities(metrics),
        "unseen": tables.unseen(metrics),
        "error_tables": tables.error_table(metrics),
        "plates": metrics.record.plates,
        "second_engine": tables.second_engine(metrics),
        "as_measured": tables.as_measured(metrics),
        "figure_halves": tables.in_halves(tables.figure_tables(metrics)),
        "quantity_notes": run_grids.notes(metrics),
        "body": body,
        "shared": shared,
        "parameters": _parameters(metrics.identification, bars if shared else ()),
        "statistics": whole and curve_statistics.tables(whole, subject),
        "correlated": _correlated(metrics.identification),
        "correction": _correction(metrics.correction, PREDICTED if metrics.predicted else ACCURACY),
        "spatiotemporal": walk.spatiotemporal,
        "sheet": sheet(metrics, subject),
        "scaling": _scaling(folder / "scaling.csv"),
        "training": training,
        "learned": metrics.training and metrics.training.in_words(),
        "picture": walk_pictures(folder, metrics),
        "provenance": before,
        "dates": credibility.dates(before),
        "hashes": credibility.hashes(folder),
        "version": gaitval.__version__,
        "checks": checklist.checklist(metrics, credibility.beside_metrics(folder, metrics)),
        "not_done": checklist.NOT_DONE,
        "pushes": metrics.push_recovery,
        "push_rows": _push_rows(metrics.push_recovery),
        "kept_distance": balance_figure.kept_distance(pushes.placed if pushes else ()),
        "consistency": metrics.record.consistency,
        "contradictions": not {"moments", "forces"}
        & {name for name, *_ in not_recorded(metrics.origins)},
        "measured_force": measured_force(metrics.record),
        "curve_names": figures.NAMES,
        "drawings": drawn | _drawings(metrics, training, pushes),
        "data": data | figure_data.of_run(metrics, training, pushes),
    }


def _configuration(folder: Path, settings: Sequence[str] = ()) -> Configuration:
    """Of the run, with what is asked for now."""
    path = folder / "configuration.toml"
    return load_configuration(path if path.exists() else None, settings=settings)


def write_report(folder: Path, settings: Sequence[str] = ()) -> None:
    """Write `report.html` and `report.pdf` of a run `folder`, `report-details.html`, which stands
    behind them, and the checklist as CSV.

    The HTML needs no other file; its scripts show the replay of the walk, for which the PDF, from
    the same template, has six poses. A section whose input is missing says so. `settings`, texts
    like `report.paper=letter`, take precedence over the run's configuration. Raises ArtefactError
    if `metrics.json` is missing or an input is damaged, SubjectError if `subject.toml` cannot be
    used.
    """
    looks = _configuration(folder, settings).report
    context = _context(folder, looks.convention) | counted(looks.convention)
    checklist.write_checklist(folder, context["checks"])
    write_page(
        folder, "report", TEMPLATE, context, looks,
        scripts=SCRIPTS, beside=DETAILS,
    )  # fmt: skip
