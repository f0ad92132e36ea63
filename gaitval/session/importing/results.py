"""Content of `import.json`, as typed models.

The models are the schema: `scripts/schemas.py` writes it beside them. A figure that could not be
measured is null.
"""

from typing import Annotated, Final, Literal

from pydantic import AliasChoices, Field

from gaitval.configuration import ProcessingSettings
from gaitval.metrics.curve_results import QuantityResult
from gaitval.metrics.typed import (
    Count,
    Flag,
    Number,
    Result,
    Sha256,
    Sides,
    StrictPositive,
    as_version,
)

IMPORT_VERSION: Final = 2
"""Of `import.json`. Version 1 is the same with another key (`doubts`), and is read."""

_Figure = Number | None
Point = Annotated[list[Number], Field(min_length=3, max_length=3)]
_MeanAndDeviation = Annotated[list[_Figure], Field(min_length=2, max_length=2)]
"""Mean and standard deviation over gait cycles; the deviation of one cycle is null."""


class InputResult(Result):
    """A file that was read."""

    role: Literal["static", "trial", "forces", "functional", "model"]
    name: str
    sha256: Sha256
    size: Count
    """Bytes."""


class PersonResult(Result):
    """Who was recorded."""

    identifier: str
    sex: Literal["F", "M"]
    mass_kg: StrictPositive
    height_m: StrictPositive


class LengthResult(Result):
    """A length of the body before and after the joint fit, m, with standard deviations."""

    name: str
    prior: Number
    prior_sd: Number
    fitted: Number
    standard_error: _Figure
    at_bound: Flag


class LimitResult(Result):
    """A published limit, and whether the import keeps it."""

    id: str
    target: str
    value: _Figure
    limit: Number
    unit: str
    passed: Flag
    verdict: Literal["passed", "FAILED", "not judged"] | None = None
    """What is said of it; older files have none."""


class PlacementResult(Result):
    """How well the markers of the standing trial are on their landmarks."""

    name: str
    value: _Figure
    limit: Number
    unit: str
    source: str
    passed: Flag


class MarkerErrorsResult(Result):
    """Distances of the markers from their places on the model, m."""

    rms: _Figure
    largest: _Figure
    worst: str
    by_marker: dict[str, _Figure]
    """RMS of each."""


class AnchoringResult(Result):
    """How resting feet slid before and after they were anchored, m."""

    sliding_before: _Figure
    sliding_after: _Figure
    largest_before: _Figure
    largest_after: _Figure
    marker_rms_before: _Figure
    marker_rms_after: _Figure


class GaitResult(Result):
    """Spatiotemporal parameters of a side; s, steps/min, m, shares of the cycle, m/s."""

    stride_time: _MeanAndDeviation
    step_time: _MeanAndDeviation
    cadence: _MeanAndDeviation
    stride_length: _MeanAndDeviation
    step_length: _MeanAndDeviation
    step_width: _MeanAndDeviation
    stance_fraction: _MeanAndDeviation
    double_support_fraction: _MeanAndDeviation
    speed: _MeanAndDeviation
    walk_ratio: _MeanAndDeviation


class GaitBySide(Sides[GaitResult]):
    """Right and left."""


class ResidualsResult(Result):
    """What inverse dynamics leaves on the pelvis, N and Nm; see `Residuals`."""

    force_rms: _Figure
    force_peak: _Figure
    moment_rms: _Figure
    moment_peak: _Figure
    force_share: _Figure
    moment_share: _Figure
    frames: Count


class ConsistentResult(Result):
    """What `--consistent` changed: coordinates rad or m (RMS), markers m, masses."""

    coordinate_change: dict[str, _Figure]
    marker_change_rms_m: _Figure
    marker_change_max_m: _Figure
    mass_factors: dict[str, Number]
    trunk_offset_m: Point


class FunctionalHipResult(Result):
    """A functional hip centre beside that of the regression, m; axes of the pelvis are forward,
    left, up.
    """

    difference_m: Point
    """From the regression's centre to the functional one, in the axes of the pelvis."""
    standard_error_m: Number
    images_apart_m: Number
    """Distance of the images of the centre in the pelvis and in the thigh."""
    residual_m: Number
    ranges_deg: Point
    to_ankle_m: Number
    to_ankle_error_m: Number
    regression_to_ankle_m: Number
    regression_error_m: Number


class FunctionalKneeResult(Result):
    """A functional knee axis beside the line across the epicondyles, rad."""

    angle_rad: Number
    rotation_rad: Number
    """About the thigh's long axis, internal positive."""
    higher_m: Number | None = None
    """By which the axis passes above the knee's centre; None in an older import."""
    standard_error_rad: Number
    images_apart_rad: Number
    residual_m: Number
    ranges_deg: Point


class FunctionalResult(Result):
    """What a range-of-motion trial shows of one joint."""

    trial: str
    side: Literal["right", "left"]
    joint: Literal["hip", "knee"]
    refused: str
    """Why it was not found; empty if it was."""
    hip: FunctionalHipResult | None = None
    knee: FunctionalKneeResult | None = None


class GivenCentreResult(Result):
    """A joint centre that came with the recording, beside that of the body."""

    source: str
    side: Literal["right", "left"]
    joint: Literal["hip", "knee", "ankle"]
    difference_m: Point
    """From ours to it, in the segment above: forward, outwards, up."""
    flexion_moment_Nm_per_kg: _Figure
    """RMS over stance, by which the moments about the two differ."""
    abduction_moment_Nm_per_kg: _Figure
    used: Flag
    """Whether the body was given it (`--joint-centres given`)."""


class WarningResult(Result):
    """A figure that physics, or everybody's walking, contradicts; see `gait.quality_flags`."""

    trial: str
    check: str
    where: str
    value: _Figure
    limit: Number
    unit: str
    message: str


class FindingResult(Result):
    """What was looked for in a trial (`gaitval.findings`), also where its limits are kept."""

    trial: str
    name: str
    where: str
    value: _Figure
    low: _Figure
    """Null where there is no such limit."""
    high: _Figure
    unit: str


class TrialResult(Result):
    """One walking trial."""

    trial: str
    belt_speed_m_s: _Figure
    marker_errors_m: dict[Literal["joint fit", "marker pairs"], MarkerErrorsResult]
    """Of the body; older files also have those of one scaled by marker pairs."""
    anchoring: AnchoringResult
    frames_not_converged: Count
    gait: GaitBySide
    findings: list[str]
    residuals: dict[str, ResidualsResult]
    """As recorded, and made consistent; empty without forces of both feet."""
    consistent: ConsistentResult | None = None


class ImportResult(Result):
    """What an import found: figures, decisions, hashes of the inputs, versions."""

    schema_version: Annotated[Literal[2], as_version(IMPORT_VERSION, 1)]
    versions: dict[str, str]
    inputs: list[InputResult]
    person: PersonResult
    processing: ProcessingSettings
    marker_set: str
    axes: str
    decisions: list[tuple[str, str]]
    """The step, and what was decided or found."""
    lengths_m: list[LengthResult]
    measurements: dict[str, Number | Point | dict[str, str]]
    """`Measurements` of the body, m and rad, and where they come from."""
    model: Sha256
    """Of the masses, joints and inertias of the body."""
    weight_ratio: _Figure
    """Mean vertical force over the body's weight."""
    walking_speed_m_s: _Figure
    verdicts: list[LimitResult]
    placement: list[PlacementResult]
    warnings: list[WarningResult] = Field(
        default_factory=list, validation_alias=AliasChoices("warnings", "doubts")
    )
    findings: list[FindingResult] = Field(default_factory=list)
    measurement: list[dict[str, str | _Figure]] = Field(default_factory=list)
    """Each a `gaitval.session.measurement.fault_text.FaultRow`."""
    bands: dict[str, dict[str, list[_Figure] | dict[str, Number]]] = Field(default_factory=dict)
    """Of each curve: `half` of the width of its band of 90 %, `sources`: shares of it, and `again`:
    half of the width without what is alike in every session of the person."""
    bands_at_once: _Figure = None
    """Standard deviations of `again` within which 95 % of second sessions are at every point of
    every curve; older files have none."""
    trials: Annotated[list[TrialResult], Field(min_length=1)]
    functional: list[FunctionalResult] = Field(default_factory=list)
    given_centres: list[GivenCentreResult] = Field(default_factory=list)
    factors: dict[str, Number] = Field(default_factory=dict)
    """In older files, by which marker pairs would scale the generic body."""
    quantities: dict[str, QuantityResult] = Field(default_factory=dict)
    """What follows from the mean curves (`gaitval.quantities`), by name."""
