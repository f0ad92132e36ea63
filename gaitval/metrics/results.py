"""Contents of `metrics.json` and `identification.json`, as typed models.

The models are the schema: `scripts/schemas.py` writes it beside them. It is long because the files
have many parts, each of which is one model.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval._internal.text.display import Displayed
from gaitval.configuration import PushSettings
from gaitval.coordinates import SIDES
from gaitval.gait.record import LowPass, Origin
from gaitval.metrics.curve_results import (
    CentreOfMass,
    CurveError,
    CurveLights,
    Epsilon,
    GaitProfiles,
    HipCentres,
    JointPower,
    Kind,
    Kinds,
    KnownTo,
    MeanCurve,
    MeasuredErrors,
    PredictedCurves,
    PredictionResult,
    QuantityResult,
    RecordResult,
    UnseenResult,
)
from gaitval.metrics.learning_gain import LearningGain
from gaitval.metrics.origin import Origins, ReadBy, Status
from gaitval.metrics.tolerances import Measure, Verdict
from gaitval.metrics.typed import (
    Count,
    Flag,
    Number,
    OpenResult,
    Result,
    Sha256,
    Share,
    Sides,
    Size,
    StrictPositive,
    named,
    same_version,
)
from gaitval.model.parameters import PARAMETERS
from gaitval.subjects.prediction.known import QUANTITIES, RecordedQuantity
from gaitval.walk.reference.adjustment import JOINTS

if TYPE_CHECKING:
    import pandas as pd

METRICS: Final = "metrics.json"
SCHEMA_VERSION: Final = 14
"""Of `metrics.json`."""
IDENTIFICATION_VERSION: Final = 2
"""Of `identification.json`, which does not contain it."""


class CountBySide(Sides[Count]):
    """Right and left."""


class Endurance(Result):
    """How far the rollout from one start phase went, see `gaitval.metrics.rollouts.endurance`."""

    start_phase: Number
    """Of the right gait cycle."""
    fell: Flag
    """The rollout ended early."""
    seconds: Size
    cycles: CountBySide
    """Complete gait cycles in a row after the settling ones."""
    scuffs: CountBySide
    """Contacts too short for a stance."""
    walking_speed: Number | None
    """m/s over whole right cycles; null without any."""
    engine: Literal["compiled", "dart", "mujoco"] = "dart"
    """That it walked in; a file without it is from when all walked in DART."""


class Repeat(Result):
    """What was measured of a repeat of the compared walk, see gaitval/metrics/repeats.py."""

    start_phase: Number
    noise: Size
    """rad, of its start."""
    seed: Count
    fell: Flag
    measures: dict[str, dict[str, Number | None]]
    """By measure and target."""


class FootContact(Result):
    """How one foot met the ground, see gaitval/metrics/foot_contact.py."""

    stances: Count
    bounces_per_stance: Number | None
    transient_peak: Number | None
    """Largest unfiltered vertical force in the first 15 % of stance, % BW, mean."""


class FootContacts(Sides[FootContact]):
    """Right and left foot."""


class PushRecovery(Result):
    """Recovery from horizontal pushes at the pelvis, see gaitval/metrics/push_recovery.py."""

    seconds: StrictPositive
    """s, how long each push lasts."""
    cycles: StrictPositive
    """Gait cycles without a fall after which a push counts as survived."""
    resolution: StrictPositive
    """N, the finest step in force."""
    ceiling: Size
    """N, the largest push tested: a walker that survived it may survive more."""
    phases: Annotated[list[Number], Field(min_length=1)]
    """Of the right gait cycle."""
    directions: Annotated[list[Number], Field(min_length=1)]
    """Degrees from straight ahead, left positive."""
    largest: list[Annotated[list[Size], Field(min_length=1)]]
    """By phase and direction, N: the largest force up to which every tested push was survived."""
    force: Size
    """N, of the push that must be survived."""
    criterion_directions: list[Number]
    """Degrees, those within 90° of straight ahead."""
    survived: list[list[Flag]]
    """By phase and criterion direction: whether the push of `force` was survived."""

    def targets(self) -> list[str]:
        """What a limit on pushes is about, by phase: with the force, if it is not the usual one."""
        usual = self.force == PushSettings().force
        return [
            f"phase {p:g}" if usual else f"phase {p:g}, {self.force:.0f} N" for p in self.phases
        ]


class PushTrace(Result):
    """Velocity of the centre of mass around a push, with five digits."""

    phase: Number
    """Of the right gait cycle at which the push begins."""
    direction: Number
    """Degrees from straight ahead, left positive."""
    force: Size
    """N."""
    fell: Flag
    cycles: list[Number]
    """Gait cycles since the beginning of the push."""
    velocity: list[Annotated[list[Number], Field(min_length=3, max_length=3)]]
    """m/s: forward, left, up."""


class PlacedFoot(Result):
    """A push to the side, and the first step after it that there was time for, see
    gaitval/metrics/foot_placement.py. Changes from the undisturbed walk, m to the left; null
    without such a step.
    """

    phase: Number
    """Of the right gait cycle at which the push begins."""
    direction: Number
    """Degrees from straight ahead, left positive."""
    force: Size
    """N."""
    fell: Flag
    side: Literal["right", "left"] | None
    """Of the foot."""
    lead: Size | None
    """s, from the beginning of the push to the heel strike."""
    foot: Number | None
    extrapolated: Number | None
    """Of the extrapolated centre of mass at the heel strike."""
    pendulum: Number | None
    """Of the foot by the capture point of a linear inverted pendulum."""


class StoredPushes(Result):
    """What a run folder keeps of its pushes: `push.json`, with all digits."""

    recovery: PushRecovery
    traces: list[PushTrace]
    placed: list[PlacedFoot] = Field(default_factory=list)
    """Of pushes to the side; none in folders of earlier versions."""


PARTS: Final = ("feed_forward", "servo", "policy", "passive")
"""Of the moment at a coordinate."""


class MomentShare(Result):
    """A part of the moment at a coordinate, see gaitval/metrics/torque_shares.py."""

    rms: Size
    """Nm/kg."""
    r_squared: Number | None
    """Share of the moment's variance that the part alone explains: 1 − residual over variance,
    below 0 where the part alone is worse than the mean; null for a constant moment."""


_PART, _PARTS = named(PARTS)
TorqueShares = dict[str, Annotated[dict[Annotated[str, _PART], MomentShare], *_PARTS]]
"""By actuated coordinate and part."""


class StoredStarts(Result):
    """How far the corrected walker got from every start phase, see `rollouts.walked_far`."""

    starts: list[Endurance]


class StoredWalks(Result):
    """How far the rollout from each start phase went: `rollouts/walks.json`, with all digits."""

    nominal: list[Endurance]
    identified: list[Endurance] | None = None
    second_engine: Endurance | None = None
    """In the second physics engine."""
    centring: Size | None = None
    """Share of the policy's action bias that was taken away, if not the configured one."""
    torque_shares: TorqueShares | None = None
    """Of the walk that is validated."""


class ErrorRow(Result):
    """RMSE of a curve of the walk, mean over the sides that were recorded, in `unit`."""

    kind: Kind
    curve: str
    """Without its side."""
    unit: str
    as_measured: Number | None
    """From the curve as it was measured, before any correction of the plates."""
    corrected: Number | None
    """From the curve that the walk is compared with: of the corrected plates, the moments of the
    hip about the hip centres that the record's moments are about."""
    own_hips: Number | None
    """Likewise, of the moments of the hip about the walker's own hip centres; of other curves it is
    `corrected`."""
    correction: Number | None
    """RMS difference that the correction of the plates makes to the measured curve."""
    prediction: Number | None
    """Mean error of the best prediction without a model of each side; null without one."""

    @property
    def of_hip(self) -> bool:
        """Whether it is a moment of the hip, which hangs on where the hip centre is."""
        return self.kind == "moments" and self.curve.startswith("hip_")


class Learned(Result):
    """What was learned for this person, and what the walk was given."""

    samples: Count
    """Of training for this person."""
    epsilon_before: Number
    epsilon_after: Number | None
    """Of the walk before the correction of the reference, in the chosen round of Algorithm 1, and
    of the walk that is shown; null where that is too short."""
    epsilon_reference: StrictPositive
    """Of a walker that follows the reference exactly."""
    kappa: StrictPositive
    """The paper's rule to stop: the first below this many times that of the reference."""
    feed_forward: Annotated[list[Number], Field(max_length=2)]
    """Least and largest share of the variance of a sagittal moment that feed-forward explains."""
    fitted_numbers: Count
    """That the correction fits, walk by walk; 0 without one."""

    @property
    def ratio_before(self) -> float:
        """Epsilon before the correction over that of the reference."""
        return self.epsilon_before / self.epsilon_reference

    @property
    def ratio_after(self) -> float | None:
        """Epsilon of the walk that is shown over that of the reference."""
        return None if self.epsilon_after is None else self.epsilon_after / self.epsilon_reference

    @property
    def rule_met(self) -> bool:
        """Whether the paper's rule is met."""
        return self.ratio_before < self.kappa


class Summary(Result):
    """The verdict in numbers."""

    accepted: Count
    refused: Count
    """Rows of role acceptance that passed, and that did not."""
    not_shown: Count = 0
    """Of those refused: not nearer than the best prediction, but by no more than walks differ."""
    curves: Count = 0
    nearer: Count = 0
    """Curves that have a prediction without a model, and those of them to which the walk is nearer
    than any such prediction."""
    guess_judged: Count = 0
    guess_within: Count = 0
    """Limits on the errors of these curves, and how many of them the best prediction would meet."""
    errors: list[ErrorRow] = Field(default_factory=list)
    """Of every curve that was recorded."""
    learned: Learned | None = None
    """Null where no round of Algorithm 1 was run."""


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

    def of(self, kind: Kind) -> str:
        """That of a kind of curves."""
        return str(getattr(self, kind))


class Method(Result):
    """How rollouts were compared."""

    centring: Size | None = None
    """Share of the policy's action bias that was taken from its actions."""
    model_mass_kg: Size
    gravity_m_s2: Size
    body_weight_n: Size
    event_threshold_n: Size
    filter_frequency_hz: Size
    record_low_pass: LowPass | None = None
    settling_cycles: Count
    cycles: Count
    consecutive_cycles: Count
    """Planned cycles of each rollout after the settling ones."""
    epsilon: str
    external_load: str


Spatiotemporal = Literal[
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


class SpatiotemporalResult(Result):
    """A spatiotemporal parameter of a rollout, and of the record."""

    name: Spatiotemporal
    unit: str
    mean: Number | None
    sd: Number | None
    recorded: Number | None
    """Null at a speed that nobody recorded; files of earlier versions have the predicted one."""
    predicted: Number | None = None
    """At a speed that nobody recorded."""

    @property
    def wanted(self) -> float | None:
        """What the walk is compared with: recorded or predicted."""
        return self.recorded if self.predicted is None else self.predicted


class WalkedCurves(Kinds[MeanCurve]):
    """Simulated, in the units of the curves."""


class CurveErrors(Kinds[CurveError | None]):
    """In the units of the curves; null where there is no cycle."""


class WalkResult(Result):
    """The rollouts with one set of body parameters."""

    mu: Annotated[list[Number], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]
    starts: Annotated[list[Endurance], Field(min_length=1)]
    cycles: CountBySide
    """Number of gait cycles in the curves."""
    spatiotemporal: list[SpatiotemporalResult]
    foot_contact: FootContacts
    curves: WalkedCurves
    errors: CurveErrors
    errors_as_measured: MeasuredErrors | None
    """Null where the record needs no correction of its plates."""
    joint_power: JointPower | None
    centre_of_mass: CentreOfMass | None
    epsilon: Epsilon | None
    hip_centres: HipCentres | None = None
    """Null where moments are compared about the model's own hips, as in files of earlier
    versions."""
    quantities: dict[str, QuantityResult] = Field(default_factory=dict)
    """As of the record."""
    energy: dict[str, Number] = Field(default_factory=dict)
    """Where it goes, J/kg in a right stride: net work of both sides' joints by kind and of the
    ground (`contact`), the `change` of the body's energy, and what they leave `unexplained` of it.
    Empty without a cycle, and in files of earlier versions."""


class WalkResults(Result):
    """At the nominal and at the identified body parameters."""

    nominal: WalkResult
    identified: WalkResult | None


class ComparedMeasure(Measure):
    """A value of the final walk, and whether what it is compared with was known to the model."""

    comparison: Status
    origin: Origin | None = None
    """Where what it is compared with comes from; null for what needs no record. Only what was
    recorded judges: any other value is a distance, without verdict, goal or skill."""


class Generation(OpenResult):
    """One generation of the search."""

    generation: Count
    best: Number | None
    sigma: Number | None


class Round(OpenResult):
    """One round of Algorithm 1."""

    round: Count
    epsilon: Epsilon | None
    """At mu*, mean over the start phases."""
    epsilon_nominal: Epsilon | None = None
    scatter: Number | None = None
    """SD of epsilon over the start phases."""
    floor: Number | None = None
    """Epsilon of the reference itself."""


Determination = Literal["identified", "weak", "not identified", "at its bound"]
"""What the record says about a parameter, see gaitval/identification/verdicts.py."""

_Parameters = Annotated[list[Number], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]


class ParameterSum(OpenResult):
    """A sum of parameters that matters as one, m, about its prior mean."""

    name: str
    prior_standard_deviation: Size
    mean: Number
    standard_deviation: Size
    verdict: Determination


class ExtendedResult(OpenResult):
    """A parameter of the sole or of both legs, which is 0 as scaled; of earlier versions."""

    name: str
    unit: str
    prior_standard_deviation: Size
    mean: Number
    standard_deviation: Size
    verdict: Determination


class FoundParameters(OpenResult):
    """One identification, in the order of `gaitval.model.parameters.PARAMETERS`."""

    names: Annotated[list[str], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))]
    nominal: _Parameters
    """The body as scaled. The prior's mean is the same, but with `identification.method = shared`
    it is moved from there by what other people's records say of everybody."""
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
        list[Determination], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))
    ]
    profiles: list[Annotated[list[Number], Field(min_length=4, max_length=4)]] = Field(
        default_factory=list
    )
    """Of `identification.method = posterior` of 0.7.0 and before: growth of the deviance at -2, -1,
    1, 2 SD of each parameter, all else at its best."""
    correlation: Annotated[
        list[_Parameters], Field(min_length=len(PARAMETERS), max_length=len(PARAMETERS))
    ]
    combinations: list[ParameterSum]
    extended: list[ExtendedResult] = Field(default_factory=list)
    """Likewise, where they were looked for; the walker does not use them."""
    plates: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """m, by how much the centre of pressure of the right and left plate is further forward."""
    deviance_nominal: Number | None
    deviance_identified: Number | None
    """Minus twice the log posterior, with the body as scaled and as found, up to a constant; none
    if nothing was looked for. With method `shared` the first has neither the errors that angles and
    belt share nor the moved prior, so that the difference is not the body's alone."""
    converged: Flag
    search_distance: Number | None
    """Likewise: between CMA-ES's result and the mode, in posterior SDs."""
    history: list[Generation]

    @property
    def determined(self) -> list[str]:
        """Names of the parameters that the record determined; where it determined none, the body is
        what was expected of this person, and is not to be called identified.
        """
        return [
            name
            for name, verdict in zip(self.names, self.verdicts, strict=True)
            if verdict == "identified"
        ]


class IdentificationResult(FoundParameters):
    """The identification of the chosen round of Algorithm 1: `identification.json`."""

    epsilon_nominal: Epsilon | None
    epsilon_identified: Epsilon | None
    rounds: list[Round]
    chosen_round: Count | None = None
    searched: _Parameters | None = None
    """What the search found, where the record does not support it and the body stays nominal."""


class CorrectedCurve(Result):
    """RMSE of a curve from its target before and after the correction, in `units`."""

    kind: Literal["angles", "moments", "forces"]
    curve: str
    fitted: bool
    """Whether the correction looks at it; the others show whether it does harm."""
    before: Number
    after: Number


class CorrectionResult(Result):
    """Change of the reference motion: angles in rad (mean, cosines and sines over the right gait
    cycle), height of the pelvis in m. Errors are those of `correction.walked.Walked`.
    """

    joints: Annotated[list[str], Field(min_length=len(JOINTS), max_length=len(JOINTS))]
    harmonics: Annotated[list[list[Number]], Field(min_length=len(JOINTS), max_length=len(JOINTS))]
    height: Number
    errors: list[Number]
    share: Share = 1.0
    """Of what was found, the part that is used: less than 1 where the whole did harm."""
    numbers: Count
    """Of harmonics and height."""
    effective_number: Size
    """Of them, those that the walk answers to and the prior leaves free."""
    refused: str | None
    """Why what was found is not used."""
    curves: list[CorrectedCurve]


class SecondEngineResult(Result):
    """The final walk's body and policy in a second physics engine, for the compared cycles."""

    engine: str
    fell: Flag
    cycles: CountBySide
    limits: Count
    """Of acceptance, that such a walk can be held against."""
    limits_met: Count
    measures: list[Measure]


class HeldOutError(Result):
    """Mean RMSE of a group of curves over the trials that were held out."""

    group: str
    unit: str
    mean: Size
    sd: Size | None
    """Between the trials; null with one."""


class HeldOutErrors(Result):
    """How wrong predictions of recorded trials are, see gaitval/metrics/other_trials.py."""

    trials: Count
    """Two trials of a person at two speeds are one difference and count once, as do trials at one
    speed."""
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


class Metrics(Displayed, Result):
    """The validation of a subject's simulated walks against the recorded gait.

    Curves run over each side's own gait cycle, 0 to 100 %. Signs: flexion, dorsiflexion, adduction,
    inversion, internal rotation, anterior tilt, own side up, own side forward; forces of the ground
    on the foot, forward, towards the midline, up.
    """

    schema_version: Literal[14]
    subject: SubjectResult
    units: CurveUnits
    method: Method
    record: RecordResult
    recorded: list[RecordedQuantity]
    """Where moments and forces are missing, those of `record` are only expected, from other people,
    and nothing is judged by them."""
    known: Annotated[dict[Annotated[str, _QUANTITY], list[ReadBy]], *_QUANTITIES]
    """What read each quantity of the record before the comparison; nothing where it is empty."""
    predictions: list[PredictionResult]
    """Of the record, without a model; the skill of a curve is relative to the best of them."""
    unseen: list[UnseenResult]
    """The final walk against further trials at the same speed."""
    prediction_errors: HeldOutErrors | None = None
    """Of held-out trials, where nothing was recorded at the walk's speed."""
    predicted: PredictedCurves | None = None
    """Without a model, of a walk at another speed; null in files of earlier versions."""
    walks: WalkResults
    final: Literal["nominal", "identified"]
    """The rollouts that measures and tolerances refer to."""
    measures: list[ComparedMeasure]
    tolerances: list[Verdict]
    summary: Summary
    lights: CurveLights
    """Whether each curve of the final walk may be believed."""
    known_to: list[KnownTo]
    """What the error of each group of curves is known to."""
    push_recovery: PushRecovery | None
    torque_shares: TorqueShares | None = None
    """Of the final walk."""
    second_engine: SecondEngineResult | None = None
    gait_profiles: GaitProfiles | None = None
    """Of the final walk; null with fewer than two gait cycles."""
    identification: IdentificationResult | None
    correction: CorrectionResult | None
    training: LearningGain | None
    provenance: Provenance

    @model_validator(mode="after")
    def _has_the_final_walk(self) -> Self:
        if self.final == "identified" and self.walks.identified is None:
            raise ValueError("final is identified, but there are no rollouts with that body")
        return self

    @property
    def walk(self) -> WalkResult:
        """The walk that measures and tolerances refer to."""
        identified = self.walks.identified if self.final == "identified" else None
        return identified or self.walks.nominal

    @property
    def origins(self) -> Origins:
        """Where what the walk is compared with comes from."""
        return {
            quantity: {side: found.of(side) for side in SIDES}
            for quantity, found in self.record.origins.items()
        }

    @property
    def is_recorded_at_all(self) -> bool:
        """Whether anything that the walk is compared with was recorded."""
        return any("recorded" in sides.values() for sides in self.origins.values())

    def save(self, path: str | Path) -> None:
        """Write `metrics.json` into a folder, whole or not at all."""
        write_json(Path(path) / METRICS, self.as_dict())

    def title(self) -> str:
        """Whose metrics, and how many limits are met, or that nothing was recorded to judge by."""
        counts, name = self.summary, self.subject.identifier
        if not self.is_recorded_at_all:
            return f"Study of {name}: nothing was recorded of such a walk, accuracy is not judged"
        return (
            f"Study of {name}: {counts.accepted} of {counts.accepted + counts.refused} limits met"
        )

    def overview(self) -> "pd.DataFrame":
        """Each limit that decides the verdict, and how many of its measures meet it."""
        from gaitval.metrics.tables import limits_met

        return limits_met(self.tolerances)

    def to_frame(self) -> "pd.DataFrame":
        """Mean curves of walk and record at 0, 1, … 100 % of each side's gait cycle:
        joint angles (deg), joint moments (Nm/kg), ground reaction (% of body weight), and what
        follows from them (`gaitval.quantities`). A column `source` says whose each row is.
        """
        from gaitval.metrics.curve_results import KINDS
        from gaitval.metrics.tables import mean_curves
        from gaitval.metrics.walk_quantities import quantities_of_record, quantities_of_walk

        name = self.subject.identifier
        other = "record of" if self.is_recorded_at_all else "prediction for"
        walk, record = f"walk of {name}", f"the {other} {name}"
        return mean_curves(
            {walk: self.walk.curves, record: self.record.curves},
            {kind: self.units.of(kind) for kind in KINDS},
            {walk: quantities_of_walk(self.walk), record: quantities_of_record(self.record)},
        )


def read_metrics(file: str | Path) -> Metrics:
    """The metrics in a file, or in the `metrics.json` of a folder; see `metrics_from`."""
    file = Path(file)
    file = file / METRICS if file.is_dir() else file
    return metrics_from(read_json(file), str(file))


def metrics_from(values: Any, origin: str) -> Metrics:
    """Typed metrics from the `values` of the file `origin`. Raises ArtefactError where they do not
    match the schema. Other versions are refused, not converted: their verdicts are for other
    limits.
    """
    same_version(
        values,
        origin,
        file="metrics.json",
        version=SCHEMA_VERSION,
        fix="Write it again: `gaitval stage validate SUBJECT` in a run folder, `gaitval baseline` "
        "for a stored baseline.",
    )
    fix = "run `gaitval stage validate SUBJECT` again"
    return Metrics.read(values, origin, file="metrics.json", fix=fix)


def identification_from(values: Any, origin: str) -> IdentificationResult | FoundParameters:
    """A typed identification from the `values` of the file `origin`, of one round or the chosen
    one. Raises ArtefactError where they do not match the schema.
    """
    chosen = isinstance(values, dict) and "rounds" in values
    model = IdentificationResult if chosen else FoundParameters
    fix = "run `gaitval stage identify SUBJECT --force`"
    return model.read(values, origin, file="identification.json", fix=fix)
