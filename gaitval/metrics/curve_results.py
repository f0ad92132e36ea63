"""What files say of curves, as typed models: of record, predictions and walk.

They stand apart from `results`, and from the functions that make them, because imports use some of
them and load neither a walk nor an engine.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Final, Generic, Literal, TypeVar, get_args

from pydantic import Field

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, PELVIS_ANGLES, Curves
from gaitval.gait.plate_correction import PlateCorrection
from gaitval.gait.record import RECORDED_ANGLES, Origin
from gaitval.metrics.typed import (
    Count,
    Curve,
    Flag,
    Number,
    Result,
    Share,
    Sides,
    Size,
    StrictPositive,
    array,
    named,
    sided,
)
from gaitval.quantities.joint_power import BURSTS, JOINTS
from gaitval.subjects.prediction.known import QUANTITIES, RecordedQuantity

T = TypeVar("T")

Kind = Literal["angles", "moments", "forces"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

_ANGLE, _ANGLES = named(sided((*RECORDED_ANGLES, *PELVIS_ANGLES)))
_MOMENT, _MOMENTS = named(sided(JOINT_MOMENTS))
_FORCE, _FORCES = named(sided(FORCES))


class Kinds(Result, Generic[T]):
    """Something of every curve."""

    angles: Annotated[dict[Annotated[str, _ANGLE], T], *_ANGLES]
    moments: Annotated[dict[Annotated[str, _MOMENT], T], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], T], *_FORCES]

    def of(self, kind: Kind) -> dict[str, T]:
        """Those of a kind, by the name of the curve."""
        found: dict[str, T] = getattr(self, kind)
        return found

    def items(self) -> Iterator[tuple[Kind, str, T]]:
        """Kind, name and value of each."""
        return ((kind, name, each) for kind in KINDS for name, each in self.of(kind).items())


RMSE: Final[Mapping[Kind, str]] = {
    "angles": "angle_rmse",
    "moments": "moment_rmse",
    "forces": "force_rmse",
}
"""Measure of the errors of each kind of curve."""
SKILL: Final[Mapping[Kind, str]] = {
    "angles": "angle_skill",
    "moments": "moment_skill",
    "forces": "force_skill",
}
"""Measure of the skill of each kind of curve."""
OF_SKILL: Final[Mapping[str, Kind]] = {measure: kind for kind, measure in SKILL.items()}


class RecordedCurves(Kinds[Curve]):
    """The record, in the units of the curves."""


class RecordedFigures(Result):
    """Spatiotemporal parameters of the record; m/s, steps/min, s, fractions of the cycle, m."""

    walking_speed: Number
    cadence: Number
    stride_time_right: Number
    stride_time_left: Number
    stance_fraction_right: Number
    stance_fraction_left: Number
    double_support_fraction: Number
    step_length_right: Number
    step_length_left: Number
    step_width: Number | None = None
    """None if steps were not measured; their lengths then follow from speed and time."""


_QUANTITY, _QUANTITIES = named(QUANTITIES)

CentreOfMass = Annotated[
    list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
    Field(min_length=101, max_length=101),
]
"""m: forward, left, up at 0 to 100 % of the right cycle, less the mean and the steady travel."""


class MeasuredCurves(Result):
    """Moments and forces as the plates measured them."""

    moments: Annotated[dict[Annotated[str, _MOMENT], Curve], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], Curve], *_FORCES]


class MeasuredErrors(Result):
    """RMSE of the walk from the moments and forces as measured."""

    moments: Annotated[dict[Annotated[str, _MOMENT], Size | None], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], Size | None], *_FORCES]


class SideOrigins(Sides[Origin]):
    """Where a quantity comes from."""


RecordOrigins = Annotated[dict[Annotated[RecordedQuantity, _QUANTITY], SideOrigins], *_QUANTITIES]


_POWER, _POWERS = named(sided(JOINTS))


_BURST, _BURST_NAMES = named(sided(tuple(BURSTS)))


class JointPower(Result):
    """Power and work of hip, knee and ankle of a walk or a record, by name with `_r` or `_l`."""

    power: Annotated[dict[Annotated[str, _POWER], Curve], *_POWERS]
    """W/kg, mean over the cycles."""
    bursts: Annotated[dict[Annotated[str, _BURST], Number | None], *_BURST_NAMES]
    """W/kg, power at each of `BURSTS`; null where the curve has no such burst."""
    generated: Annotated[dict[Annotated[str, _POWER], Size], *_POWERS]
    """J/kg in a gait cycle."""
    absorbed: Annotated[dict[Annotated[str, _POWER], Size], *_POWERS]


class QuantityResult(Result):
    """A quantity of a walk, a record or an import, by name with `_r` or `_l`."""

    curves: dict[str, Curve]
    """Mean over the cycles, in `unit`."""
    unit: str
    figures: dict[str, dict[str, Number | None]] = Field(default_factory=dict)
    """By kind and name; null where there is none."""
    figure_units: dict[str, str] = Field(default_factory=dict)


class ForceComponents(Result):
    """Body weights, by world axis."""

    forward: Number
    left: Number
    vertical: Number


class Asymmetry(Result):
    """Difference of a moment of both legs over each side's own cycle, Nm/kg."""

    mean_difference: Number
    """Right less left."""
    rms_difference: Size
    """Root mean square of right less left."""


class MomentAsymmetry(Result):
    """Of the sagittal moments."""

    hip_flexion: Asymmetry
    knee_angle: Asymmetry
    ankle_angle: Asymmetry

    def by_name(self) -> dict[str, Asymmetry]:
        """The moments, in the order of their names."""
        return dict(sorted(self))


class Consistency(Result):
    """What a record contradicts."""

    mean_force: ForceComponents
    """Mean over the gait cycle of the ground reaction under both feet; 0, 0, 1 in steady
    walking."""
    force_rmse_bound: ForceComponents
    """RMSE, averaged over both feet, that no steady walk can be below."""
    vertical_rmse_bound_in_stance: Size
    """Body weights: the same of the worse foot where no simulated foot is loaded in the recorded
    swing."""
    moment_asymmetry: MomentAsymmetry


class RecordResult(Result):
    """The recorded gait, without the faults of the force plates."""

    curves: RecordedCurves
    joint_power: JointPower
    centre_of_mass: CentreOfMass
    plates: PlateCorrection | None
    """Null if nothing is clearly wrong with them."""
    as_measured: MeasuredCurves | None
    """Null where `plates` is."""
    spatiotemporal: RecordedFigures
    left_phase: Number
    consistency: Consistency
    quantities: dict[str, QuantityResult] = Field(default_factory=dict)
    """What else follows from the curves, by name; empty in files of earlier versions."""
    origins: RecordOrigins
    """Where each quantity of each side comes from. Only what was recorded judges a walk."""


class PredictionErrors(Kinds[Size | None]):
    """RMSE by curve, in the units of the curves; null where the curve was not recorded."""


class PredictionResult(Result):
    """A prediction of the record without a model, see gaitval/metrics/baselines.py."""

    name: str
    known: str
    """What it knows of the person."""
    people: Count
    rmse: PredictionErrors
    about_nearest_hips: dict[str, Size] = Field(default_factory=dict)
    """RMSE of the moments of the hips, Nm/kg, about the point that brings the prediction nearest;
    empty where those of the walk are about the model's own hips."""
    own: Flag = False
    """Whether it is made from the person's own other trials."""
    figures: dict[str, dict[str, Size]] = Field(default_factory=dict)
    """Its errors of stance fraction (% of cycle), step length (cm) and speed (%), by measure and
    target, where they were recorded."""

    def error(self, kind: Kind, curve: str) -> float | None:
        """RMSE of a curve, with as many free numbers as the walk has; None where there is none."""
        found = self.about_nearest_hips.get(curve) if kind == "moments" else None
        return self.rmse.of(kind)[curve] if found is None else found


class UnseenErrors(Kinds[Size | None]):
    """RMSE of the walk by curve, in the units of the curves."""


class UnseenCorrelations(Kinds[Number | None]):
    """Coefficients of multiple correlation by curve."""


class UnseenResult(Result):
    """A trial at the same speed that was held out, see gaitval/metrics/other_trials.py."""

    trial: str
    speed: StrictPositive
    rmse: UnseenErrors
    between: PredictionErrors
    """RMSE between this trial and the compared one."""
    multiple_correlation: UnseenCorrelations
    """Of these two trials."""


class Region(Result):
    """Neighbouring points at which curves differ."""

    first: Count
    """Index of the first point; % of the gait cycle where there are 101."""
    last: Count
    """Of the last one, which is part of the region."""
    p: Share
    """Probability that the cycle has a |t| as large as the largest here by chance."""


class GaitProfile(Sides[Size]):
    """Gait Profile Score of each side, deg, and its variables."""

    scores: dict[str, Size]
    """Gait variable scores by name with `_r` or `_l`: the Movement Analysis Profile."""
    total: Size
    """Of both sides."""


class GaitProfiles(Result):
    """Of the record and of the walk, from the same variables."""

    variables: list[str]
    record: GaitProfile | None
    """Null unless the angles of both sides were recorded."""
    walk: GaitProfile


class StatisticalCurves(Kinds[Curve]):
    """Of each curve and side, in the units of the curves."""


class PredictionBand(Result):
    """Around each predicted curve, by how wrong predictions of recorded trials are, see
    gaitval/metrics/other_trials.py.
    """

    share: Share
    """Of people whose curve is to be within it, at each percent."""
    trials: Count
    """Held out; two of a person with two speeds count once, for they are one difference."""
    people: Count
    away: Size
    """Difference of dimensionless speed from the nearest known trial; the band grows with it."""
    half_width: StatisticalCurves


class PredictedCurves(Result):
    """The curves that the statistics of other trials and other people predict: the best answer to
    what the person does at this speed. The walk follows them as far as a body can.
    """

    curves: StatisticalCurves
    band: PredictionBand | None = Field(None)
    """Null where too few trials can be held out."""


Light = Literal["believe", "with care", "do not"]
"""Whether a curve of the walk may be believed."""

Reason = Literal[
    "nearer",
    "narrow",
    "engine",
    "not shown",
    "guess",
    "limit",
    "record",
    "not recorded",
    "held out",
    "no guess",
    "too short",
]
"""Why. Believe: it is "nearer" to the measured curve than the best prediction without a model. With
care: it is, but not in every repeated walk ("narrow") or not in the second "engine"; that it is
nearer is "not shown"; nothing was recorded to judge it by ("not recorded"), or there is "no guess"
to compare with. Do not: the "guess" is nearer, it misses its "limit", it is not within what the
"record" is known to, its group is further from the prediction than predictions of "held out" trials
are from their records, or the walk is "too short"."""


class CurveLight(Result):
    """Whether a curve of the final walk may be believed, and why."""

    light: Light
    reason: Reason
    error: Number | None
    """RMSE of the walk, in the unit of the curve; null where it is too short."""
    guess: str | None
    """The best guess without a model, by its name in `predictions`; null without one."""
    guess_error: Size | None
    """Its RMSE of this curve."""
    known: Size | None
    """What the record itself is known to: half the width of its 90 % band, median over the cycle;
    null where the record does not say."""


class CurveLights(Kinds[CurveLight]):
    """Of every curve."""


class KnownTo(Result):
    """What the mean RMSE of a group of curves is known to: a difference below all of these is none.

    All are in `unit`, means over the curves of the group on both sides.
    """

    group: str
    """Of `gaitval.metrics.baselines.GROUPS`."""
    unit: str
    record: Size | None
    """Half the width of the 90 % band of the recorded mean curves, as the import found it; null
    where only mean curves are known, as of the built-in people."""
    time_step: Size | None
    """RMS difference of the mean curves from those of the whole study made anew at a quarter of
    the physics step: the largest of the built-in people's in `time_step.csv`."""
    second_engine: Size | None
    """RMS difference of the mean curves from those of the same walk in the second engine."""


class CurveError(Result):
    """How a mean simulated curve differs from the recorded one, in the curve's unit."""

    rmse: Number | None
    """Root mean square over the 101 samples."""
    peak_error: Number | None
    """The largest difference, simulated less recorded, with its sign."""
    peak_percent: Annotated[Count, Field(le=100)]
    """Where it is, % of the gait cycle."""
    bias: Number | None
    """Mean difference."""
    correlation: Number | None
    """Pearson's; null if one of the curves is constant."""


class HipCentre(Result):
    """Where the hip centre that the record's moments are about lies, as the reference was fitted:
    by so much forward and outward of the model's, m. See `walk.reference.hip_moments.about_record`.
    """

    forward: Number
    outward: Number
    rmse_about_model: dict[str, Size]
    """Nm/kg; what the errors of the hip's moments would be about the model's own hip, by
    coordinate."""


class HipCentres(Sides[HipCentre]):
    """Of both sides."""


class MeanCurve(Result):
    """Mean and standard deviation over the cycles; null where there are too few."""

    mean: Curve | None
    sd: Curve | None


class Epsilon(Result):
    """Epsilon and its parts, see gaitval/metrics/epsilon.py."""

    angles: Number | None
    """The normalised parts; they add up to `total`."""
    moments: Number | None
    forces: Number | None
    total: Number | None
    """Compared with kappa."""
    angles_rad: Number | None = None
    """The parts before normalisation."""
    moments_nm_per_kg: Number | None = None
    forces_body_weights: Number | None = None


CURVE_UNITS: Final[Mapping[Kind, str]] = {"angles": "deg", "moments": "Nm/kg", "forces": "% BW"}
"""Units of the curves and their errors in `metrics.json`."""


_SCALE: Final[Mapping[Kind, float]] = {"angles": 180.0 / math.pi, "moments": 1.0, "forces": 100.0}


def by_kind(curves: Curves) -> dict[Kind, dict[str, Array]]:
    """The curves of each kind in the units of `CURVE_UNITS`."""
    return {
        kind: {name: curve * scale for name, curve in getattr(curves, kind).items()}
        for kind, scale in _SCALE.items()
    }


def from_kinds(values: Iterable[tuple[Kind, str, Sequence[float | None]]]) -> Curves:
    """The curves of a file, from kind, name and `values` of each in the units of `CURVE_UNITS`."""
    found = Curves({}, {}, {})
    for kind, name, curve in values:
        getattr(found, kind)[name] = array(curve) / _SCALE[kind]
    return found


def mean_curves(curves: Curves) -> Curves:
    """The means (101,) of `curves` (n, 101), without those that have no cycle."""
    return Curves(
        **{
            kind: {n: each.mean(axis=0) for n, each in getattr(curves, kind).items() if len(each)}
            for kind in _SCALE
        }
    )
