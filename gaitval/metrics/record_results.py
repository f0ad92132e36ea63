"""The record's part of `metrics.json`, as typed models, and what is said of every curve."""

from typing import Annotated, Generic, TypeVar

from pydantic import Field

from gaitval.gait.record import RECORDED_ANGLES
from gaitval.metrics.comparison import FORCES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.metrics.typed import Count, Number, Result, Size, named

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


class RecordResult(Result):
    """The recorded gait."""

    curves: RecordedCurves
    spatiotemporal: RecordedFigures
    left_phase: Number
    consistency: ConsistencyResult


class PredictionErrors(Kinds[Size]):
    """RMSE by curve, in the units of the curves."""


class PredictionResult(Result):
    """A prediction of the record without a model, see gaitval/metrics/baselines.py."""

    name: str
    told: str
    """What it knows of the person."""
    people: Count
    rmse: PredictionErrors
