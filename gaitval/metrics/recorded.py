"""The record's part of `metrics.json`: the curves that a walk is compared with, in its units."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.plate_correction import PlateCorrection
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import rms
from gaitval.metrics.origin import Origins, everything
from gaitval.metrics.quantity_results import found_quantities, power_result, quantity_results
from gaitval.metrics.record_consistency import consistency
from gaitval.metrics.record_results import (
    Kind,
    Kinds,
    MeasuredCurves,
    MeasuredErrors,
    RecordedCurves,
    RecordedFigures,
    RecordResult,
    SideOrigins,
)
from gaitval.metrics.typed import array, number, numbers
from gaitval.metrics.walk_results import MeanCurve
from gaitval.metrics.whole_body import record_centre_of_mass
from gaitval.model.ground import LEVEL, Ground

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject

CURVE_UNITS: Final[Mapping[Kind, str]] = {"angles": "deg", "moments": "Nm/kg", "forces": "% BW"}
"""Units of the curves and their errors in `metrics.json`."""
_SCALE: Final[Mapping[Kind, float]] = {"angles": 180.0 / math.pi, "moments": 1.0, "forces": 100.0}


def by_kind(curves: Curves) -> dict[Kind, dict[str, Array]]:
    """The curves of each kind in the units of `CURVE_UNITS`."""
    return {
        kind: {name: curve * scale for name, curve in getattr(curves, kind).items()}
        for kind, scale in _SCALE.items()
    }


def recorded_part(
    record: GaitRecord,
    subject: "Subject | None" = None,
    ground: Ground = LEVEL,
    laden: float = 1.0,
    hip_centre: Array | None = None,
    *,
    origins: Origins | None = None,
) -> RecordResult:
    """The part of `metrics.json` about `record`, which is in the axes of the `ground`; `subject`
    has the corrections of its plates, `laden` and `hip_centre` are as in `found_quantities`,
    `origins` say where it comes from; all was recorded if they are left out.
    """
    phase = np.arange(1000) / 1000
    steps, lengths = record.steps, step_lengths(record)
    # phases of the right cycle at which each foot is in stance; the left one starts at left_phase
    right_on = phase <= record.stance_fraction["right"]
    left_on = (phase - record.left_phase) % 1.0 <= record.stance_fraction["left"]
    curves = recorded_curves(record)
    times = dict.fromkeys("rl", record.stride_time)
    found = found_quantities(curves, times, speed=record.speed, laden=laden, hip_centre=hip_centre)
    power = power_result(found)
    assert power is not None  # a record has a cycle
    plates = None if subject is None else subject.plates
    measured = None
    if subject is not None and plates is not None:
        kinds = by_kind(recorded_curves(subject.measured()))
        measured = MeasuredCurves(
            moments=_listed(kinds["moments"]), forces=_listed(kinds["forces"])
        )
    return RecordResult(
        curves=RecordedCurves(**{kind: _listed(each) for kind, each in by_kind(curves).items()}),
        joint_power=power,
        centre_of_mass=record_centre_of_mass(record, ground).tolist(),
        # what was not given is written too
        plates=None if plates is None else PlateCorrection(**plates.model_dump()),
        as_measured=measured,
        spatiotemporal=RecordedFigures(
            walking_speed=record.speed,
            cadence=120.0 / record.stride_time,
            stride_time_right=record.stride_time,
            stride_time_left=record.stride_time,
            stance_fraction_right=record.stance_fraction["right"],
            stance_fraction_left=record.stance_fraction["left"],
            double_support_fraction=float((right_on & left_on).mean()),
            step_length_right=lengths["right"],
            step_length_left=lengths["left"],
            # unset, it is not in the file: hashes of records without steps stay
            **({"step_width": steps.width} if steps else {}),
        ),
        left_phase=record.left_phase,
        consistency=consistency(record),
        quantities=quantity_results(found),
        origins={
            quantity: SideOrigins(right=sides["right"], left=sides["left"])
            for quantity, sides in (origins or everything("recorded")).items()
        },
    )


def step_lengths(record: GaitRecord) -> dict[Side, float]:
    """Step lengths of a `record`, m; unmeasured ones are those of feet that land equally far ahead
    of the body (limit step-length).
    """
    if record.steps is not None:
        return {"right": record.steps.right, "left": record.steps.left}
    stride = record.speed * record.stride_time
    return {"right": stride * (1.0 - record.left_phase), "left": stride * record.left_phase}


def _listed(curves: Mapping[str, Array]) -> dict[str, list[float | None]]:
    return {name: numbers(curve) for name, curve in curves.items()}


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


def errors_as_measured(
    curves: Kinds[MeanCurve], measured: MeasuredCurves | None
) -> MeasuredErrors | None:
    """RMSE of the mean `curves` from those `measured`, before any correction of the plates."""
    if measured is None:
        return None

    def errors(
        walked: Mapping[str, MeanCurve], before: Mapping[str, list[float | None]]
    ) -> dict[str, float | None]:
        return {
            name: None
            if curve.mean is None
            else number(rms(array(curve.mean) - array(before[name])))
            for name, curve in walked.items()
        }

    return MeasuredErrors(
        moments=errors(curves.moments, measured.moments),
        forces=errors(curves.forces, measured.forces),
    )
