"""Contents of `metrics.json` and `identification.json`, as typed models.

The models are the schema: `scripts/schemas.py` writes it beside them. It is long because the files
have many parts, each of which is one model.
"""

from typing import Annotated, Any, Final, Literal

from pydantic import Field

from gaitval.errors import ArtefactError
from gaitval.gait.record import Origin
from gaitval.metrics.record_results import (
    Curve,
    JointPowerResult,
    Kinds,
    MeasuredErrors,
    Path,
    PredictionResult,
    RecordResult,
    Sides,
    UnseenResult,
)
from gaitval.metrics.told_measures import ReadBy, Status
from gaitval.metrics.tolerances import WALK_UNITS
from gaitval.metrics.torque_shares import PARTS
from gaitval.metrics.typed import (
    Count,
    Flag,
    Number,
    OpenResult,
    Positive,
    Result,
    Sha256,
    Size,
    named,
    same_version,
)
from gaitval.metrics.walk_statistics import WalkStatistics
from gaitval.model.parameters import PARAMETERS
from gaitval.prediction.told import QUANTITIES, Quantity

SCHEMA_VERSION: Final = 9
"""Of `metrics.json`."""
IDENTIFICATION_VERSION: Final = 2
"""Of `identification.json`, which does not contain it."""

CORRECTED_JOINTS: Final = 13
"""Coordinates that a correction changes: `gaitval.reference.adjustment.JOINTS`."""


class CountBySide(Sides[Count]):
    """Right and left."""


class SubjectResult(Result):
    """Who walked, and the source of the record."""

    identifier: str
    source: str
    citation: str
    licence: str


class CurveUnits(Result):
    """Units of the curves and of their errors."""

    angles: Literal["deg"]
    moments: Literal["Nm/kg"]
    forces: Literal["% BW"]


class LowPassResult(Result):
    """Low-pass filters applied to the record's moments and forces before averaging."""

    moments_hz: Positive
    forces_hz: Positive


class Method(Result):
    """How rollouts were compared."""

    centring: Size | None = None
    """Share of the policy's habit that was taken from its actions."""
    model_mass_kg: Size
    gravity_m_s2: Size
    body_weight_n: Size
    event_threshold_n: Size
    filter_frequency_hz: Size
    record_low_pass: LowPassResult | None = None
    settling_cycles: Count
    cycles: Count
    consecutive_cycles: Count
    """Planned cycles of each rollout after the settling ones."""
    epsilon: str
    external_load: str


class Start(Result):
    """How far the rollout from one start phase went."""

    start_phase: Number
    fell: Flag
    seconds: Size
    cycles: CountBySide
    scuffs: CountBySide
    walking_speed: Number | None
    engine: Literal["compiled", "dart", "mujoco"] = "dart"
    """That it walked in; a file without it is from when all walked in DART."""


class SpatiotemporalResult(Result):
    """A spatiotemporal parameter of a rollout, and of the record."""

    name: Literal[
        "walking_speed",
        "cadence",
        "stride_time_right",
        "stride_time_left",
        "stance_fraction_right",
        "stance_fraction_left",
        "double_support_fraction",
        "step_length_right",
        "step_length_left",
        "step_width",
    ]
    unit: str
    mean: Number | None
    sd: Number | None
    recorded: Number | None


class MeanCurve(Result):
    """Mean and standard deviation over the cycles; null where there are too few."""

    mean: Curve | None
    sd: Curve | None


class MeanCurves(Kinds[MeanCurve]):
    """Simulated, in the units of the curves."""


class CurveErrorResult(Result):
    """How a mean simulated curve differs from the recorded one."""

    rmse: Number | None
    peak_error: Number | None
    peak_percent: Annotated[Count, Field(le=100)]
    bias: Number | None
    correlation: Number | None


class CurveErrors(Kinds[CurveErrorResult | None]):
    """In the units of the curves; null where there is no cycle."""


class EpsilonResult(Result):
    """Epsilon and its parts, see gaitval/metrics/epsilon.py."""

    angles: Number | None
    moments: Number | None
    forces: Number | None
    total: Number | None
    angles_rad: Number | None = None
    moments_nm_per_kg: Number | None = None
    forces_body_weights: Number | None = None


class PressurePath(Result):
    """Centre of pressure over stance in the footprint, % of foot length from the heel, towards
    the midline.
    """

    along: MeanCurve
    across: MeanCurve


_PERCENT, _PERCENTS = named(("10", "50", "90"))


class FootContactResult(Result):
    """How one foot met the ground, see gaitval/metrics/foot_contact.py."""

    stances: Count
    foot_length_m: Positive
    spheres: list[Annotated[list[Number], Field(min_length=3, max_length=3)]]
    """Along, across and radius of each contact sphere in the footprint, foot lengths."""
    path: PressurePath
    progress: Annotated[dict[Annotated[str, _PERCENT], Number | None], *_PERCENTS]
    """Centre of pressure at % of stance, % of foot length from the heel."""
    bounces_per_stance: Number | None
    transient_peak: Number | None
    """Largest unfiltered vertical force in the first 15 % of stance, % BW, mean."""


class FootContacts(Sides[FootContactResult]):
    """Right and left foot."""


class WalkResult(Result):
    """The rollouts with one set of body parameters."""

    mu: Annotated[list[Number], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]
    starts: Annotated[list[Start], Field(min_length=1)]
    cycles: CountBySide
    """Number of gait cycles in the curves."""
    spatiotemporal: list[SpatiotemporalResult]
    foot_contact: FootContacts
    curves: MeanCurves
    errors: CurveErrors
    errors_as_measured: MeasuredErrors | None
    """Null where the record needs no correction of its plates."""
    joint_power: JointPowerResult | None
    centre_of_mass: Path | None
    epsilon: EpsilonResult | None


class WalkResults(Result):
    """At the nominal and at the identified body parameters."""

    nominal: WalkResult
    identified: WalkResult | None


MeasureName = Annotated[str, Field(pattern=f"^({'|'.join(sorted(WALK_UNITS))})$")]


class MeasureResult(Result):
    """A measured value; null if the rollout was too short."""

    measure: MeasureName
    target: str
    value: Number | None
    unit: str


class ComparedMeasure(MeasureResult):
    """A measured value of the final walk, and whether what it is compared with was told."""

    comparison: Status
    origin: Origin | None = None
    """Where what it is compared with comes from; null for what needs no record. Only what was
    recorded judges: any other value is a distance, without verdict, goal or skill."""


class SpreadResult(Result):
    """A verdict in repeats, see gaitval/metrics/spread.py."""

    repeats: Count
    """Walks from other starts with noise; pushes of `push_survival`; start phases of endurance."""
    kept: Count
    """Of them, those that keep the limit; pushes that were survived; walks without a fall."""
    low: Number | None
    high: Number | None
    """90 % interval, in the measure's unit; null with fewer than three repeats."""
    close: Flag
    """The limit is kept, but not by all repeats and the whole interval, or one push more that is
    not survived would fail it."""


class VerdictResult(Result):
    """The verdict of a tolerance on a measured value."""

    id: str
    title: str
    measure: MeasureName
    unit: str
    limit: Literal["at_most", "at_least", "exactly"]
    goal: Number | None
    """A stricter limit to aim at."""
    role: Literal["acceptance", "context"]
    status: Literal["published", "derived", "convention"]
    verified: Flag
    citation: str
    locator: str
    note: str
    remedy: str = ""
    """What to do where it fails; empty in files from before it was told."""
    target: str
    value: Number | None
    tolerance: Number
    passed: Flag
    reached: Flag | None
    """Whether the goal is reached; null without one."""
    spread: SpreadResult | None = None
    """Null where nothing was repeated."""


class Summary(Result):
    """Of the rows of role acceptance: passed, failed, with a goal, and with the goal reached."""

    accepted: Count
    refused: Count
    goals: Count
    goals_reached: Count


class Generation(OpenResult):
    """One generation of the search."""

    generation: Count
    best: Number | None
    sigma: Number | None


class Round(OpenResult):
    """One round of Algorithm 1."""

    round: Count
    epsilon: EpsilonResult | None
    """At mu*, mean over the start phases."""
    epsilon_nominal: EpsilonResult | None = None
    scatter: Number | None = None
    """SD of epsilon over the start phases."""
    floor: Number | None = None
    """Epsilon of the reference itself."""


_Parameters = Annotated[list[Number], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]


class Combination(OpenResult):
    """A sum of parameters that matters as one, m, about its prior mean."""

    name: str
    prior_standard_deviation: Size
    mean: Number
    standard_deviation: Size
    verdict: Literal["identified", "weak", "not identified"]


class Extended(OpenResult):
    """A parameter of `gaitval.model.extended`, which is 0 as scaled."""

    name: str
    unit: str
    prior_standard_deviation: Size
    mean: Number
    standard_deviation: Size
    verdict: Literal["identified", "weak", "not identified"]


class FoundParameters(OpenResult):
    """One identification, in the order of `gaitval.model.parameters.PARAMETERS`."""

    names: Annotated[list[str], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]
    nominal: _Parameters
    """Mean of the prior: the body as scaled."""
    identified: _Parameters
    """What the body walks with: what the record does not determine stays nominal."""
    prior_standard_deviation: _Parameters
    posterior_mean: _Parameters
    standard_deviation: _Parameters
    """Of the posterior."""
    lower: _Parameters
    upper: _Parameters
    on_bound: Annotated[list[Flag], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]
    verdicts: Annotated[
        list[Literal["identified", "weak", "not identified", "at its bound"]],
        Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS)),
    ]
    profiles: list[Annotated[list[Number], Field(min_length=4, max_length=4)]] = Field(
        default_factory=list
    )
    """Growth of the deviance at -2, -1, 1, 2 SD of each parameter, all else at its best."""
    correlation: Annotated[
        list[_Parameters], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))
    ]
    combinations: list[Combination]
    extended: list[Extended] = Field(default_factory=list)
    """Empty unless they were looked for; the walker does not use them."""
    plates: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """m, by how much the centre of pressure of the right and left plate is further forward."""
    deviance_nominal: Number | None
    deviance_identified: Number | None
    """Minus twice the log posterior, up to the same constant; none if nothing was looked for."""
    converged: Flag
    search_distance: Number | None
    """Between CMA-ES's result and the mode, in posterior SDs."""
    history: list[Generation]


class IdentificationResult(FoundParameters):
    """The identification of the chosen round of Algorithm 1: `identification.json`."""

    epsilon_nominal: EpsilonResult | None
    epsilon_identified: EpsilonResult | None
    rounds: list[Round]
    chosen_round: Count | None = None
    searched: _Parameters | None = None
    """What the search found, where the record does not support it and the body stays nominal."""


class CorrectedCurve(Result):
    """RMSE of a curve from the reference before and after the correction, in `units`."""

    kind: Literal["angles", "moments", "forces"]
    curve: str
    fitted: bool
    """Whether the correction looks at it; the others tell whether it does harm."""
    before: Number
    after: Number


class CorrectionResult(Result):
    """Change of the reference motion: angles in rad (mean, cosines and sines over the right gait
    cycle), height of the pelvis in m. Errors are those of `learning_control.correct.Walked`.
    """

    joints: Annotated[list[str], Field(min_length=CORRECTED_JOINTS, max_length=CORRECTED_JOINTS)]
    harmonics: Annotated[
        list[list[Number]], Field(min_length=CORRECTED_JOINTS, max_length=CORRECTED_JOINTS)
    ]
    height: Number
    errors: list[Number]
    numbers: Count
    """Of harmonics and height."""
    effective_number: Size
    """Of them, those that the walk answers to and the prior leaves free."""
    refused: str | None
    """Why what was found is not used."""
    curves: list[CorrectedCurve]


class PushRecoveryResult(Result):
    """Recovery from horizontal pushes at the pelvis, see gaitval/metrics/push_recovery.py."""

    seconds: Positive
    cycles: Positive
    resolution: Positive
    ceiling: Size
    phases: Annotated[list[Number], Field(min_length=1)]
    directions: Annotated[list[Number], Field(min_length=1)]
    """Degrees from straight ahead, left positive."""
    largest: list[Annotated[list[Size], Field(min_length=1)]]
    """By phase and direction, N: the largest force up to which every tested push was survived."""
    force: Size
    criterion_directions: list[Number]
    survived: list[list[Flag]]
    """By phase and criterion direction: whether the push of `force` was survived."""


class ShareResult(Result):
    """A part of the moment at a coordinate, see gaitval/metrics/torque_shares.py."""

    rms: Size
    """Nm/kg."""
    r_squared: Number | None
    """Share of the moment's variance that the part alone explains."""


_PART, _PARTS = named(PARTS)
TorqueShares = dict[str, Annotated[dict[Annotated[str, _PART], ShareResult], *_PARTS]]
"""By actuated coordinate and part."""


class WitnessResult(Result):
    """The final walk's body and policy in a second physics engine, for the compared cycles."""

    engine: str
    fell: Flag
    cycles: CountBySide
    goals: Count
    """Goals of acceptance that such a walk can be held against."""
    goals_reached: Count
    measures: list[MeasureResult]


class HeldOutError(Result):
    """Mean RMSE of a group of curves over the trials that were held out."""

    group: str
    unit: str
    mean: Size
    sd: Size | None
    """Between the trials; null with one."""


class HeldOutErrors(Result):
    """How wrong gaitval's predictions of recorded trials are, see gaitval/metrics/held_out.py."""

    trials: Count
    people: Count
    own: Flag
    """Whether they are trials of this person; else of other people, because this one has too
    few."""
    groups: list[HeldOutError]


class Provenance(Result):
    """Versions, and hashes of what was compared: of contents, not of files, so that none of them is
    what `sha256sum` prints. `configuration` leaves out how pages look, `record` is in no file of
    its own. The report prints the hashes of the files.
    """

    versions: dict[str, str]
    configuration: Sha256
    subject: Sha256
    record: Sha256


_QUANTITY, _QUANTITIES = named(QUANTITIES)


class Metrics(Result):
    """The validation of a subject's simulated walks against the recorded gait.

    Curves run over each side's own gait cycle, 0 to 100 %. Signs: flexion, dorsiflexion, adduction,
    inversion, internal rotation, anterior tilt, own side up, own side forward; forces of the ground
    on the foot, forward, towards the midline, up.
    """

    schema_version: Literal[9]
    subject: SubjectResult
    units: CurveUnits
    method: Method
    record: RecordResult
    recorded: list[Quantity]
    """Where moments and forces are missing, those of `record` are only expected, from other people,
    and nothing is judged by them."""
    told: Annotated[dict[Annotated[str, _QUANTITY], list[ReadBy]], *_QUANTITIES]
    """What read each quantity of the record before the comparison; nothing where it is empty."""
    predictions: list[PredictionResult]
    """Of the record, without a model; skill is told against the first."""
    unseen: list[UnseenResult]
    """The final walk against further trials at the same speed."""
    prediction_errors: HeldOutErrors | None = None
    """Of held-out trials, where nothing was recorded at the walk's speed."""
    walks: WalkResults
    final: Literal["nominal", "identified"]
    """The rollouts that measures and tolerances refer to."""
    measures: list[ComparedMeasure]
    tolerances: list[VerdictResult]
    summary: Summary
    push_recovery: PushRecoveryResult | None
    torque_shares: TorqueShares | None = None
    """Of the final walk."""
    witness: WitnessResult | None = None
    curve_statistics: WalkStatistics | None = None
    """Of the final walk; null with fewer than two gait cycles."""
    identification: IdentificationResult | None
    correction: CorrectionResult | None
    training: dict[str, Any] | None
    provenance: Provenance


def metrics_from(values: Any, origin: str) -> Metrics:
    """Typed metrics from the values read from a file.

    Other versions are refused, not converted, because their verdicts are for other limits.

    Parameters
    ----------
    origin : where they come from, for the message.

    Raises
    ------
    ArtefactError : they are of another version, or do not match the schema; the message says where.
    """
    same_version(
        values,
        origin,
        file="metrics.json",
        version=SCHEMA_VERSION,
        mend="Write it again: `gaitval validate` in a run folder, `gaitval baseline` for a "
        "stored baseline.",
    )
    found = Metrics.read(values, origin, file="metrics.json", mend="run `gaitval validate` again")
    source = found.subject.source
    if found.record.origins is None and (source.endswith(" predicted") or ", mirrored" in source):
        raise ArtefactError(
            f"{origin}: an earlier gaitval wrote it and judged the walk by what was not recorded "
            f"({source}). Run the same command again, which judges only what was recorded."
        )
    return found


def check_metrics(metrics: Any, origin: str) -> None:
    """Raise ArtefactError, as `metrics_from` does, if `metrics` cannot be used."""
    metrics_from(metrics, origin)


def identification_from(values: Any, origin: str) -> IdentificationResult | FoundParameters:
    """A typed identification from the values read from a file, of one round or the chosen one.

    Raises
    ------
    ArtefactError : they do not match the schema; the message says where.
    """
    chosen = isinstance(values, dict) and "rounds" in values
    model = IdentificationResult if chosen else FoundParameters
    return model.read(
        values, origin, file="identification.json", mend="run `gaitval identify --force`"
    )
