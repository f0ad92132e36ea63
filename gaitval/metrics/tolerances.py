"""The tolerance registry (`tolerances.toml`) and its verdict on measured values."""

import operator
import tomllib
from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval._internal.text.display import Displayed
from gaitval.coordinates import split_side
from gaitval.metrics.side_measures import SIDE_MEASURES
from gaitval.metrics.typed import Count, Flag, Number, Result, Size, number
from gaitval.quantities import QUANTITIES

if TYPE_CHECKING:
    import pandas as pd


WALK_UNITS = {
    "angle_rmse": "deg",
    "moment_rmse": "Nm/kg",
    "force_rmse": "% BW",
    "moment_rmse_as_measured": "Nm/kg",
    "force_rmse_as_measured": "% BW",
    "moment_rmse_own_hips": "Nm/kg",
    "angle_skill": "1",
    "moment_skill": "1",
    "force_skill": "1",
    "unfiltered_force_rmse": "% BW",
    "force_ringing": "% BW",
    "shoulder_moment_rms": "Nm",
    "shoulder_moment_peak": "Nm",
    "arm_work_share": "%",
    "trunk_motion": "SD",
    "lumbar_moment_peak": "Nm/kg",
    "toe_moment_peak": "Nm/kg",
    "toe_work": "J/kg",
    "moment_ringing": "Nm/kg",
    "torque_rate": "Nm/kg/s",
    "free_moment_peak": "% BW height",
    "foot_creep": "cm/s",
    "knee_beyond_range": "deg",
    "step_width": "SD",
    "step_width_error": "cm",
    **{measure.name: measure.unit for each in QUANTITIES for measure in each.measures},
    "centre_of_mass_rmse": "mm",
    **{each.name: each.unit for each in SIDE_MEASURES},
    "speed_error": "%",
    "stride_time_error": "%",
    "stance_fraction_error": "% of cycle",
    "step_length_error": "cm",
    "epsilon": "1",
    "consecutive_cycles": "cycles",
    "falls": "walks",
    "push_survival": "%",
}
"""Everything that is measured of a walk, and its unit. RMSE are of the mean curve over the gait
cycle, see `whole_error`; the errors of speed and stride time are sizes of relative differences from
the record, those of stance fraction (percentage points of the cycle) and step length sizes of
differences; `push_survival` is the share of directions in which a push is survived. Skill is 1 less
the RMSE over that of the best prediction without a model (`baselines`); ringing, arms, trunk and
step width (against other people's, or the person's own) are those of `unrecorded`, toes, rates of
torque and what the ground does to a foot those of `torques`, joint power, work and others those of
`gaitval.quantities`, centre of mass that of `whole_body`, loading and the arm of the ground
reaction those of `side_measures`. SD are standard deviations between people."""

RECORDING_UNITS = {
    "scaling_marker_rms": "cm",
    "scaling_marker_largest": "cm",
    "ik_marker_rms": "cm",
    "ik_marker_largest": "cm",
    "residual_force_peak": "N",
    "residual_force_rms": "N",
    "residual_moment_peak": "Nm",
    "residual_moment_rms": "Nm",
    "residual_force_share": "%",
    "residual_moment_share": "%",
}
"""Everything that is measured on a laboratory's recordings, with units. The marker errors of
scaling are distances between the landmarks in standing and the scaled model; residuals are those of
inverse dynamics with the measured ground reaction."""

JUDGED_UNITS = {
    "moment_band_distance": "SD",
    "moment_size_factor": "1",
    "side_correlation": "1",
    "angle_beyond_range": "deg",
    "coupler_error": "deg",
    "model_mass_error": "%",
    "weight_error": "%",
    "body_mass_index": "kg/m²",
    "mass_share_factor": "1",
    "gyration_factor": "1",
    "inertia_triangle": "1",
    "side_length_difference": "%",
    "side_mass_difference": "%",
    "angle_side_difference": "deg",
    "moment_side_difference": "Nm/kg",
}
"""What else is measured on a model and results of OpenSim (`gaitval judge`), with units; see
`gaitval.apps.judge`. A factor is how many times a value is larger or smaller than the expected one,
so it is at least 1."""

UNITS = WALK_UNITS | RECORDING_UNITS | JUDGED_UNITS


def _known(name: str) -> str:
    """A check of pydantic, so that the schema of a file need not change with every new measure."""
    if name not in UNITS:
        raise ValueError("not a measure that this gaitval knows")
    return name


MeasureName = Annotated[str, Field(pattern="^[a-z][a-z0-9_]*$"), AfterValidator(_known)]
Text = Annotated[str, Field(min_length=1)]
Limit = Literal["at_most", "at_least", "above", "exactly"]
Role = Literal["acceptance", "context"]
Basis = Literal["published", "derived", "convention", "unread"]
"""Where a limit comes from: the source states it for this use, it follows from what the source
states, it is our own, or it is quoted from a source that nobody of us read in full."""
AcceptanceState = Literal["passed", "not shown", "failed"]
"""Of an acceptance limit. Not shown: no nearer to the measured curve than the best prediction
without a model, but by less than walks of the same policy differ."""
FailedBy = Literal["limit", "record"]
"""What a value misses: the limit itself, or what the measured curve itself is known to."""

_HOLDS: dict[Limit, Callable[[float, float], bool]] = {
    "at_most": operator.le,
    "at_least": operator.ge,
    "above": operator.gt,
    "exactly": operator.eq,
}


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    measure: Text
    value: Annotated[float, Field(ge=0)]
    unit: Text

    @model_validator(mode="after")
    def _unit_is_of_the_measure(self) -> "_Entry":
        if UNITS.get(self.measure) != self.unit:
            raise ValueError(
                f"{self.measure} in {self.unit}: the known measures are "
                + ", ".join(f"{name} in {unit}" for name, unit in UNITS.items())
            )
        return self


class Tolerance(_Entry):
    """A limit, its source and how certain that is; see `tolerances.toml`."""

    id: Text
    title: Text
    applies_to: tuple[Text, ...] | None = None
    limit: Limit
    role: Role
    status: Basis
    verified: bool
    citation: Text
    locator: Text
    note: Text
    remedy: Text

    @model_validator(mode="after")
    def _only_what_was_read_is_cited(self) -> "Tolerance":
        if self.verified == (self.status == "unread"):
            raise ValueError(
                f"{self.id}: status is {self.status!r} but verified is {self.verified}. What "
                'nobody read in full (verified = false) is "unread", and nothing else is.'
            )
        return self


class Margin(_Entry):
    """How much worse than the baseline a measure may be."""

    better: Literal["lower", "higher"]


class Registry(Displayed, BaseModel):
    """The limits and margins of `tolerances.toml`, or some of them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    tolerance: tuple[Tolerance, ...]
    margin: tuple[Margin, ...] = ()

    def save(self, path: str | Path) -> None:
        """Write the tolerances as JSON, whole or not at all."""
        write_json(Path(path), [row.model_dump(mode="json") for row in self.tolerance])

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError."""
        return cls.model_validate({"tolerance": read_json(Path(path))})

    def title(self) -> str:
        """How many there are."""
        return f"{len(self.tolerance)} limits"

    def overview(self) -> "pd.DataFrame":
        """What limits, and to what."""
        return self.to_frame()[["quantity", "limit", "value", "unit", "role"]]

    def to_frame(self) -> "pd.DataFrame":
        """One row a limit: quantity, measure, limit, value, unit, role, status, source."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "quantity": row.title,
                    "measure": row.measure,
                    "limit": row.limit.replace("_", " "),
                    "value": row.value,
                    "unit": row.unit,
                    "role": row.role,
                    "status": row.status,
                    "source": f"{row.citation}; {row.locator}",
                }
                for row in self.tolerance
            ]
        )


class Measure(Result):
    """A measured value; see `measured`."""

    measure: MeasureName
    target: str
    """What it was measured on: a curve (`knee_angle_r`), a start phase, a side, the phase of a
    push, or "walk"."""
    value: Number | None
    """Null if the rollout was too short to measure it."""
    unit: str


def measured(measure: str, target: str, value: float | None) -> Measure:
    """The `value` of `measure` (one of `UNITS`) on a `target`, in the unit of the measure."""
    return Measure(measure=measure, target=target, value=number(value), unit=UNITS[measure])


class Spread(Result):
    """A verdict in repeats, see gaitval/metrics/verdict_rows.py."""

    repeats: Count
    """Walks from other starts with noise; pushes of `push_survival`; start phases of endurance."""
    kept: Count
    """Of them, those that keep the limit; pushes that were survived; walks without a fall."""
    low: Number | None
    high: Number | None
    """90 % interval, in the measure's unit: of the value of one more walk, or of the share of
    pushes that are survived; null with fewer than three repeats."""
    close: Flag
    """The limit is kept, but not by all repeats and the whole interval, or one push more that is
    not survived would fail it."""


class AgainstGuess(Result):
    """A curve beside the best prediction without a model, see gaitval/metrics/acceptance.py."""

    guess: str
    """Name of that prediction, of those in `predictions`."""
    error: Size
    """Its RMSE, in the unit of the curve."""
    walk: Number | None
    """That of the walk; null where it is too short."""


class Verdict(Result):
    """The verdict of a tolerance on a measured value; a value that could not be measured fails."""

    id: str
    title: str
    measure: MeasureName
    unit: str
    limit: Limit
    role: Role
    status: Basis
    verified: Flag
    citation: str
    locator: str
    note: str
    remedy: str = ""
    """What to do where it fails; empty in files from before it was written."""
    target: str
    value: Number | None
    tolerance: Number
    """The limit itself, in the unit of the measure."""
    passed: Flag
    spread: Spread | None = None
    """Null where nothing was repeated."""
    state: AcceptanceState = "passed"
    failed_by: list[FailedBy] = Field(default_factory=list)
    """Empty if it passed."""
    guess: AgainstGuess | None = None
    """Of a skill: what the walk was compared with."""
    known: Size | None = None
    """Of a skill: what the measured curve itself is known to, half the width of its 90 % band, in
    the unit of the curve; null where that is not known."""
    guess_within: Flag | None = None
    """Of an error: whether the best prediction without a model would meet the limit in the place of
    the walk; null for what none has, such as falls."""

    def holds(self, value: float | None) -> bool:
        """Whether another value would keep the limit."""
        return holds(self.limit, value, self.tolerance)


def limits_text() -> str:
    """The registry that ships with the package, as TOML."""
    return resources.files("gaitval.metrics").joinpath("tolerances.toml").read_text("utf-8")


@cache
def load_registry() -> Registry:
    """The registry that ships with the package."""
    return Registry.model_validate(tomllib.loads(limits_text()))


def push_limit() -> float:
    """The share of pushes that acceptance asks a walker to survive, %."""
    (limit,) = [
        each.value
        for each in load_registry().tolerance
        if each.measure == "push_survival" and each.role == "acceptance"
    ]
    return limit


def _concerns(tolerance: Tolerance, measure: Measure) -> bool:
    # a tolerance names curves without side
    _, name = split_side(measure.target)
    return tolerance.measure == measure.measure and (
        tolerance.applies_to is None or name in tolerance.applies_to
    )


def holds(limit: Limit, value: float | None, bound: float) -> bool:
    """Whether `value` meets a `limit` of `bound`; None, not measured, does not."""
    return value is not None and _HOLDS[limit](value, bound)


def evaluate(measures: Sequence[Measure]) -> list[Verdict]:
    """The verdict of every tolerance on those of `measures` it applies to, in registry order."""
    return [
        Verdict(
            **tolerance.model_dump(exclude={"applies_to", "value"}),
            target=measure.target,
            value=measure.value,
            tolerance=tolerance.value,
            passed=(kept := holds(tolerance.limit, measure.value, tolerance.value)),
            state="passed" if kept else "failed",
            failed_by=[] if kept else ["limit"],
            spread=None,
        )
        for tolerance in load_registry().tolerance
        for measure in measures
        if _concerns(tolerance, measure)
    ]
