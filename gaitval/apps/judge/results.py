"""What `gaitval judge` found, as typed models: `judge.json`, its schema and its page."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gaitval.metrics.typed import Count, Flag, Number, Result, Sha256
from gaitval.reporting.written import Written

_Figure = Number | None
_FullCurve = Annotated[list[Number], Field(min_length=101, max_length=101)]


class JudgedInput(Result):
    """A file that was read."""

    role: Literal["model", "ik", "id", "markers", "grf", "external_loads"]
    name: str
    sha256: Sha256
    size: Count
    """Bytes."""


class JudgedModel(Result):
    """The model."""

    name: str
    version: Count
    """Of the file's format."""
    mass_kg: _Figure
    bodies: Count
    coordinates: Count
    markers: Count
    thigh_and_shank_m: _Figure
    """Mean of the sides."""
    stature_m: _Figure
    """As given, or that of the legs."""
    stature_given: Flag
    senses: dict[str, Literal[-1, 0, 1]]
    """Of each joint angle: 1 if the model's is positive as gaitval's is, -1 if it is negative, 0
    if it turns about another axis."""


class JudgedTrial(Result):
    """The motion."""

    start_s: Number
    end_s: Number
    frames: Count
    events_from: Literal["forces", "motion"]
    cycles: dict[Literal["right", "left"], Count]
    """Complete gait cycles."""
    walking_speed_m_s: _Figure
    belt_speed_m_s: _Figure
    """Of the treadmill, as given, as an import has it, or as the flat feet move; 0 over ground."""
    belt_given: Flag
    speed_group: str | None
    """Of the published bands."""
    weight_ratio: _Figure
    """Mean vertical force over the model's weight."""


class JudgedMarkerErrors(Result):
    """Distances of measured markers from those of the model, placed by gaitval."""

    rms_m: Number
    largest_m: Number
    frames: Count
    by_marker: dict[str, dict[Literal["rms_m", "largest_m", "at_s", "seen"], Number]]


class JudgedResiduals(Result):
    """Residual force and moment at the root; N, Nm, shares of 1."""

    force_rms: Number
    force_peak: Number
    moment_rms: Number
    moment_peak: Number
    force_share: _Figure
    moment_share: _Figure
    peak_ground_reaction: _Figure
    centre_of_mass_height: Number
    frames: Count


class JudgedMoment(Result):
    """A mean moment, Nm/kg in gaitval's signs, beside the band of healthy people."""

    mean: _FullCurve
    low: _FullCurve
    high: _FullCurve
    distance: Number
    """SD."""
    distance_if_negated: Number


class JudgedSegment(Result):
    """Mass of a segment as a share of the whole, and what the mean of de Leva's women and men
    has.
    """

    mass_kg: Number
    share: Number
    expected_share: Number


class JudgedLimit(Result):
    """A limit, and whether it is kept."""

    id: str
    title: str
    group: str
    """Heading that it stands under."""
    target: str
    value: _Figure
    limit: Number
    relation: Literal["at_most", "at_least", "exactly"]
    unit: str
    citation: str
    """Where the limit comes from."""
    passed: Flag
    decides: Flag
    """Whether the verdict depends on it; others are shown only, or not judged."""
    verdict: Literal["passed", "FAILED", "not judged", "shown only"]
    """What is said of it."""


class JudgeResult(Written):
    """What `gaitval judge` found."""

    NAME: ClassVar[str] = "judge"
    TEMPLATE: ClassVar[str] = "gaitval.apps.judge:judge.html.j2"

    schema_version: Literal[3]
    inputs: list[JudgedInput]
    passed: Flag
    """No limit that decides has failed, and of all that was given something was judged."""
    verdict: Literal["passed", "FAILED", "not judged"]
    """`not judged` where no limit failed, but what was given could not be judged."""
    model: JudgedModel
    trial: JudgedTrial | None
    marker_errors: JudgedMarkerErrors | None
    residuals: JudgedResiduals | None
    moments: dict[str, JudgedMoment]
    angles_deg: dict[str, _FullCurve]
    """Mean angles over the gait cycle, in gaitval's signs."""
    segments: dict[str, JudgedSegment]
    limits: list[JudgedLimit]
    findings: list[str]
    not_judged: list[str]
    """What could not be judged, and why."""
    undecided: list[str]
    """What was given and could not be judged at all: then `passed` is false."""
