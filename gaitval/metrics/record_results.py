"""The record's part of `metrics.json`, as typed models, and what is said of every curve."""

from collections.abc import Iterator
from typing import Annotated, Final, Generic, Literal, TypeVar, get_args

from pydantic import AliasChoices, Field

from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.gait.plate_correction import PlateCorrection
from gaitval.gait.record import RECORDED_ANGLES, Origin
from gaitval.metrics.quantity_results import JointPower, QuantityResult
from gaitval.metrics.record_consistency import Consistency
from gaitval.metrics.typed import (
    Count,
    Curve,
    Flag,
    Number,
    Result,
    Sides,
    Size,
    StrictPositive,
    named,
    sided,
)
from gaitval.prediction.known import QUANTITIES, RecordedQuantity

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
    known: str = Field(validation_alias=AliasChoices("known", "told"))
    """What it knows of the person."""
    people: Count
    rmse: PredictionErrors
    own: Flag = False
    """Whether it is made from the person's own other trials."""
    figures: dict[str, dict[str, Size]] = Field(default_factory=dict)
    """Its errors of stance fraction (% of cycle), step length (cm) and speed (%), by measure and
    target, where they were recorded."""


class UnseenErrors(Kinds[Size | None]):
    """RMSE of the walk by curve, in the units of the curves."""


class UnseenCorrelations(Kinds[Number | None]):
    """Coefficients of multiple correlation by curve."""


class UnseenResult(Result):
    """A trial at the same speed that was held out, see gaitval/metrics/unseen.py."""

    trial: str
    speed: StrictPositive
    rmse: UnseenErrors
    between: PredictionErrors
    """RMSE between this trial and the compared one."""
    multiple_correlation: UnseenCorrelations
    """Of these two trials."""
