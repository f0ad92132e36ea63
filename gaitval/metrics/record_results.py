"""The record's part of `metrics.json`, as typed models, and what is said of every curve."""

from typing import Annotated, Generic, TypeVar

from pydantic import Field

from gaitval.gait.record import RECORDED_ANGLES, Origin
from gaitval.metrics.comparison import FORCES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.metrics.joint_power import BURSTS, JOINTS
from gaitval.metrics.typed import Count, Number, Positive, Result, Size, named
from gaitval.prediction.told import QUANTITIES

T = TypeVar("T")

Curve = Annotated[list[Number | None], Field(min_length=101, max_length=101)]
"""0 to 100 % of a side's gait cycle; null where not finite."""


def _sided(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names for side in "rl")


_ANGLE, _ANGLES = named(_sided((*RECORDED_ANGLES, *PELVIS_ANGLES)))
_MOMENT, _MOMENTS = named(_sided(JOINT_MOMENTS))
_FORCE, _FORCES = named(_sided(FORCES))


class Kinds(Result, Generic[T]):
    """Something of every curve."""

    angles: Annotated[dict[Annotated[str, _ANGLE], T], *_ANGLES]
    moments: Annotated[dict[Annotated[str, _MOMENT], T], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], T], *_FORCES]


class Sides(Result, Generic[T]):
    """Something of both sides."""

    right: T
    left: T


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


class ForceComponents(Result):
    """Body weights."""

    forward: Number
    left: Number
    vertical: Number


class AsymmetryResult(Result):
    """Right less left, Nm/kg."""

    mean_difference: Number
    rms_difference: Size


class MomentAsymmetry(Result):
    """Right less left over each side's own cycle."""

    hip_flexion: AsymmetryResult
    knee_angle: AsymmetryResult
    ankle_angle: AsymmetryResult


class ConsistencyResult(Result):
    """What the record contradicts, see gaitval/metrics/record_consistency.py. Forces in body
    weights, moments in Nm/kg.
    """

    mean_force: ForceComponents
    """Mean over the gait cycle of the ground reaction under both feet; 0, 0, 1 in steady
    walking."""
    force_rmse_bound: ForceComponents
    """RMSE, averaged over both feet, that no steady walk can be below."""
    vertical_rmse_bound_in_stance: Size
    """The same of the worse foot where no simulated foot is loaded in the recorded swing."""
    moment_asymmetry: MomentAsymmetry


_QUANTITY, _QUANTITIES = named(QUANTITIES)

_POWER, _POWERS = named(_sided(JOINTS))
_BURST, _BURST_NAMES = named(_sided(tuple(BURSTS)))


class JointPowerResult(Result):
    """Power and work of hip, knee and ankle, see gaitval/metrics/joint_power.py; W/kg, J/kg."""

    power: Annotated[dict[Annotated[str, _POWER], Curve], *_POWERS]
    bursts: Annotated[dict[Annotated[str, _BURST], Number | None], *_BURST_NAMES]
    """Null where the curve has no such burst."""
    generated: Annotated[dict[Annotated[str, _POWER], Size], *_POWERS]
    absorbed: Annotated[dict[Annotated[str, _POWER], Size], *_POWERS]


Path = Annotated[
    list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
    Field(min_length=101, max_length=101),
]
"""m: forward, left, up at 0 to 100 % of the right cycle, less the mean and the steady travel."""


class PlatesResult(Result):
    """What was wrong with the force plates and is corrected in the record, see
    gaitval/gait/plate_correction.py; shifts in m, too far forward.
    """

    scale: Size
    scale_sd: Size
    shift_right: Number
    shift_right_sd: Size
    shift_left: Number
    shift_left_sd: Size


class MeasuredCurves(Result):
    """Moments and forces as the plates measured them."""

    moments: Annotated[dict[Annotated[str, _MOMENT], Curve], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], Curve], *_FORCES]


class MeasuredErrors(Result):
    """RMSE of the walk from the moments and forces as measured."""

    moments: Annotated[dict[Annotated[str, _MOMENT], Size | None], *_MOMENTS]
    forces: Annotated[dict[Annotated[str, _FORCE], Size | None], *_FORCES]


class RecordResult(Result):
    """The recorded gait, without the faults of the force plates."""

    curves: RecordedCurves
    joint_power: JointPowerResult
    centre_of_mass: Path
    plates: PlatesResult | None
    """Null if nothing is clearly wrong with them."""
    as_measured: MeasuredCurves | None
    """Null where `plates` is."""
    spatiotemporal: RecordedFigures
    left_phase: Number
    consistency: ConsistencyResult
    origins: Annotated[dict[Annotated[str, _QUANTITY], Sides[Origin]], *_QUANTITIES] | None = None
    """Where each quantity of each side comes from. Only what was recorded judges a walk. A file
    without it is from when only whole quantities could be missing: see `Metrics.recorded`."""


class PredictionErrors(Kinds[Size | None]):
    """RMSE by curve, in the units of the curves; null where the curve was not recorded."""


class PredictionResult(Result):
    """A prediction of the record without a model, see gaitval/metrics/baselines.py."""

    name: str
    told: str
    """What it knows of the person."""
    people: Count
    rmse: PredictionErrors


class UnseenErrors(Kinds[Size | None]):
    """RMSE of the walk by curve, in the units of the curves."""


class UnseenCorrelations(Kinds[Number | None]):
    """Coefficients of multiple correlation by curve."""


class UnseenResult(Result):
    """A trial at the same speed that was not told, see gaitval/metrics/unseen.py."""

    trial: str
    speed: Positive
    rmse: UnseenErrors
    between: PredictionErrors
    """RMSE between this trial and the compared one."""
    multiple_correlation: UnseenCorrelations
    """Of these two trials."""
