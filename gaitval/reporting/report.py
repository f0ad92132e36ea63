"""The report of a run folder: one page object, as self-contained HTML and as PDF."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import ClassVar, Final, NamedTuple

import numpy as np

from gaitval.configuration import RecordSettings
from gaitval.correction.walked import ACCURACY, PREDICTED, Walked
from gaitval.gait.filters import FACTOR
from gaitval.metrics.curve_results import CURVE_UNITS, KINDS, PredictionResult
from gaitval.metrics.gait_profile import is_control
from gaitval.metrics.origin import not_recorded
from gaitval.metrics.results import (
    CorrectionResult,
    Determination,
    FoundParameters,
    HeldOutError,
    Metrics,
    StoredPushes,
)
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.verdicts import (
    LimitVerdict,
    limit_verdicts,
    target_text,
    unjudged_text,
)
from gaitval.reporting import (
    balance_figure,
    body_bars,
    figure_data,
    figures,
    grids,
    healthy_profile,
    prediction_part,
    run_grids,
    tables,
)
from gaitval.reporting.facts import measured_force
from gaitval.reporting.figures import NAMES
from gaitval.reporting.healthy_profile import Healthy
from gaitval.reporting.page import Draw, counted, write_page
from gaitval.reporting.replay import SCRIPTS, Picture, walk_pictures
from gaitval.reporting.run_files import RunFiles, read_run
from gaitval.reporting.sheet import Sheet, sheet
from gaitval.subjects.prediction.slopes import is_changed
from gaitval.subjects.subject import Subject

TEMPLATE: Final = "report.html.j2"
DETAILS: Final = {"report-details": "details.html.j2"}
"""What stands behind the report: where its limits are from, how the walk was made, files."""


def within_text(row: Verdict, uncertainty: Mapping[str, float]) -> str:
    """That the error of a `row` is less than the record's `uncertainty` (half of a 90 % band)."""
    kind = row.measure.removesuffix("_rmse")
    factor = {"angle": 180.0 / np.pi, "moment": 1.0, "force": 100.0}.get(kind, 0.0)
    name = f"{kind}_{row.target}".replace("_vertical_", "_up_").replace("_medial_", "_left_")
    half = factor * uncertainty.get(name, 0.0)
    within = row.value is not None and 0.0 <= row.value < half  # other measures have none
    return f" (within the record's own uncertainty, ± {half:.2g})" if within else ""


class ParameterRow(NamedTuple):
    """A parameter of mu, or a combination of them."""

    name: str
    prior_mean: float
    prior_sd: float
    mean: float
    sd: float
    used: float | None
    verdict: Determination

    @property
    def contraction(self) -> float:
        """Posterior SD over prior SD."""
        return self.sd / self.prior_sd


def _parameters(
    found: FoundParameters | None, bars: Sequence[tuple[str, float, float]] = ()
) -> list[ParameterRow]:
    """Rows of mu and of combinations, by the posterior's means in `found`. `bars` are name, mean
    and SD about what was expected, in prior SDs, where a parameter was not expected to be as
    scaled.
    """
    if found is None:
        return []
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


class CorrectedGroup(NamedTuple):
    """Mean RMSE of a kind of curves from the target, without the correction and with it."""

    name: str
    unit: str
    fitted: bool
    before: float
    after: float


@dataclass(frozen=True)
class Correction:
    """What the correction of the reference changes, and its effect.

    Attributes
    ----------
    after : error from the target over its accuracy, with the correction.
    """

    found: CorrectionResult
    after: float
    groups: Sequence[CorrectedGroup]


def _correction(metrics: Metrics) -> Correction | None:
    found = metrics.correction
    if found is None:
        return None
    after = {(row.kind, row.curve): row.after for row in found.curves}
    accuracies = PREDICTED if metrics.predicted else ACCURACY
    return Correction(
        found,
        Walked(np.empty(0), after, accuracies).error(),
        [
            CorrectedGroup(
                kind,
                CURVE_UNITS[kind],
                fitted,
                float(np.mean([row.before for row in group])),
                float(np.mean([row.after for row in group])),
            )
            for kind in KINDS
            for fitted in (True, False)
            if (group := [row for row in found.curves if (row.kind, row.fitted) == (kind, fitted)])
        ],
    )


@dataclass(frozen=True)
class Curves:
    """The sections on curves and what follows from them.

    Attributes
    ----------
    findings : what their headings say, by kind.
    figures : tables of quantities, in two columns.
    notes : what a reader of these must know.
    """

    findings: Mapping[str, tables.CurveFinding | None]
    errors: Sequence[tables.ErrorTable]
    figures: Sequence[Sequence[tables.ShownFigures]]
    notes: Sequence[str]
    names: ClassVar = NAMES


@dataclass(frozen=True)
class Limits:
    """The sections on limits.

    Attributes
    ----------
    acceptance, context : failed ones first.
    unjudged : what was not recorded and so is not judged, in words.
    held_out : errors of predictions of held-out trials, by group.
    uncertainty : half widths of the record's bands of 90 %.
    """

    acceptance: Sequence[LimitVerdict]
    context: Sequence[LimitVerdict]
    unjudged: str
    held_out: Mapping[str, HeldOutError]
    uncertainty: Mapping[str, float]

    def failed_text(self, limit: LimitVerdict) -> str:
        """The first failed targets of a `limit` with their values; all are in the tables."""
        failed = [
            f"{target_text(row.target)}: "
            + ("not measured" if row.value is None else f"{row.value:.3g}")
            + within_text(row, self.uncertainty)
            for row in limit.failed
            if row.target != "walk"
        ]
        more = len(failed) - 6
        return "; ".join(failed[:6]) + (f"; and {more} more" if more > 0 else "")


@dataclass(frozen=True)
class Body:
    """The section on the body.

    Attributes
    ----------
    said : what was learned, in sentences; empty where no study looked for it.
    shared : whether the table is of the same posterior as the bars.
    """

    said: str
    shared: bool
    parameters: Sequence[ParameterRow]


@dataclass(frozen=True)
class Pushes:
    """The section on pushes: of those that must be survived how many were `stood` of the `tested`,
    and how the next foot is placed.
    """

    stood: int
    tested: int
    kept_distance: Mapping[str, float] | None


@dataclass(frozen=True)
class ReportPage:
    """Everything that the templates of a report show: a `run`, with a part for each section that is
    made when it is read.
    """

    run: RunFiles

    filter_factor: ClassVar = FACTOR

    @property
    def metrics(self) -> Metrics:
        """Of the run."""
        return self.run.metrics

    @property
    def subject(self) -> Subject:
        """Whose run it is."""
        return self.run.subject

    @property
    def ground(self) -> RecordSettings:
        """What was walked on, and the load."""
        return self.run.configuration.record

    @property
    def changed(self) -> bool:
        """Whether the ground is not level or the person is laden."""
        return is_changed(self.ground)

    @property
    def judged(self) -> bool:
        """Whether anything was recorded of such a walk."""
        return self.metrics.is_recorded_at_all

    @property
    def identified(self) -> bool:
        """Whether the walk is of the body that was found."""
        return self.metrics.final == "identified"

    @property
    def determined(self) -> bool:
        """Whether the record determines any parameter of the body."""
        found = self.metrics.identification
        return found is not None and bool(found.determined)

    @property
    def guess(self) -> PredictionResult | None:
        """The prediction without a model that skill is against."""
        return next(iter(self.metrics.predictions), None)

    @property
    def contradictions(self) -> bool:
        """Whether both moments and forces were recorded, so that they can contradict each other."""
        return not {"moments", "forces"} & {name for name, *_ in not_recorded(self.metrics.origins)}

    @property
    def measured_force(self) -> float:
        """Mean vertical force as the plates measured it, body weights."""
        return measured_force(self.metrics.record)

    @property
    def extensor_positive(self) -> bool:
        """Whether moments are drawn as clinical reports draw them."""
        return self.run.configuration.report.extensor_positive

    @property
    def counted(self) -> Mapping[str, object]:
        """How the angles of figures are counted."""
        return counted(self.run.configuration.report.convention)

    @cached_property
    def sheet(self) -> Sheet:
        """The first page."""
        settings = self.run.configuration
        return sheet(self.metrics, self.subject, settings.report.extensor_positive)

    @cached_property
    def picture(self) -> Picture | None:
        """The walk as replay and strip of poses."""
        return walk_pictures(self.run)

    @cached_property
    def curves(self) -> Curves:
        """Of angles, moments and forces, and what follows from them."""
        return Curves(
            tables.findings(self.metrics, self.extensor_positive),
            tables.error_tables(self.metrics, self.extensor_positive),
            tables.in_halves(tables.figure_tables(self.metrics)),
            [each.note for each in grids.FURTHER],
        )

    @cached_property
    def predicted(self) -> Sequence[prediction_part.PredictedRow]:
        """The predicted curves without a walk, by group."""
        return prediction_part.predicted_rows(self.metrics)

    @cached_property
    def limits(self) -> Limits:
        """Which limits the walk keeps."""
        errors = self.metrics.prediction_errors
        return Limits(
            limit_verdicts(self.metrics, "acceptance"),
            limit_verdicts(self.metrics, "context"),
            unjudged_text(self.metrics.origins).strip(),
            {row.group: row for row in errors.groups} if errors else {},
            self.subject.uncertainty,
        )

    @cached_property
    def known(self) -> tables.Known:
        """What the model knew of the record."""
        return tables.known_quantities(self.metrics)

    @cached_property
    def unseen(self) -> Sequence[tables.UnseenTrial]:
        """Held-out trials at the same speed."""
        return tables.unseen(self.metrics)

    @cached_property
    def healthy(self) -> Healthy | None:
        """Walk and record beside healthy people; None with fewer than two gait cycles."""
        found = self.metrics.gait_profiles
        return None if found is None else Healthy(found, is_control(self.subject))

    @cached_property
    def body(self) -> Body:
        """What was learned of the body."""
        stored, found = self.run.stages.body, self.metrics.identification
        shared = stored is not None and stored.method == "shared"
        bars = stored.bars if stored and shared else ()
        said = stored.said if stored else ""
        return Body(said, shared, _parameters(found, bars))

    @cached_property
    def pushes(self) -> Pushes:
        """How the walker recovers."""
        stored = self.run.stages.pushes
        distance = balance_figure.kept_distance(stored.placed if stored else ())
        found = self.metrics.push_recovery
        survived = [] if found is None else [each for row in found.survived for each in row]
        return Pushes(sum(survived), len(survived), distance)

    @cached_property
    def correction(self) -> Correction | None:
        """Of the reference."""
        return _correction(self.metrics)

    @cached_property
    def drawings(self) -> Mapping[str, Draw]:
        """What draws each figure."""
        stages = self.run.stages
        drawings = self._grids[0] | prediction_part.figure(self.metrics)[0]
        if stages.body is not None:
            drawings["body"] = partial(body_bars.draw, stages.body.bars)
        return drawings | _drawings(self.metrics, stages.pushes)

    @cached_property
    def data(self) -> Mapping[str, str]:
        """The numbers behind the figures."""
        stages = self.run.stages
        numbers = figure_data.of_run(self.metrics, stages.pushes)
        return self._grids[1] | prediction_part.figure(self.metrics)[1] | numbers

    @cached_property
    def _grids(self) -> tuple[dict[str, Draw], figure_data.Tables]:
        run = self.run
        strides = run_grids.strides_of(run.walk, run.metrics, run.configuration)
        return run_grids.figures(run.metrics, run.subject, strides, run.configuration.report)


def _drawings(metrics: Metrics, pushes: StoredPushes | None) -> dict[str, Draw]:
    """What draws each figure but the grids. Figures contain no text from outside."""
    drawings: dict[str, Draw] = {}
    if metrics.push_recovery is not None:
        drawings["stability"] = partial(figures.stability_regions, metrics.push_recovery)
    if pushes is not None and balance_figure.kept_distance(pushes.placed):
        draw = partial(balance_figure.foot_placement, {"": pushes.placed})
        drawings[balance_figure.NAME] = draw
    if (profiles := metrics.gait_profiles) is not None:
        drawings["gait_profile"] = partial(healthy_profile.profile, profiles)
    return drawings


def write_report(folder: Path, settings: Sequence[str] = (), out: Path | None = None) -> None:
    """Write `report.html` and `report.pdf` of a run `folder`, and `report-details.html`, which
    stands behind them.

    The HTML needs no other file; its scripts show the replay of the walk, for which the PDF, from
    the same template, has six poses. A section whose input is missing says so. `settings`, texts
    like `report.paper=letter`, take precedence over the run's configuration. `out` is another
    folder for the pages. Raises ArtefactError
    if `metrics.json` is missing or an input is damaged, SubjectError if `subject.toml` cannot be
    used.
    """
    page = ReportPage(read_run(folder, settings))
    context = {
        "page": page,
        "picture": page.picture,
        "method": page.metrics.method,
        "drawings": page.drawings,
        "data": page.data,
        **page.counted,
    }
    looks = page.run.configuration.report
    write_page(out or folder, "report", TEMPLATE, context, looks, scripts=SCRIPTS, beside=DETAILS)
