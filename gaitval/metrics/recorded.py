"""The record's part of `metrics.json`: the curves that a walk is compared with, in its units."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.plate_correction import PlateCorrection
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import (
    Asymmetry,
    Consistency,
    ForceComponents,
    Kinds,
    MeanCurve,
    MeasuredCurves,
    MeasuredErrors,
    MomentAsymmetry,
    RecordedCurves,
    RecordedFigures,
    RecordResult,
    SideOrigins,
    by_kind,
)
from gaitval.metrics.origin import Origins, everything
from gaitval.metrics.typed import array, number, numbers
from gaitval.metrics.walk_quantities import found_quantities, power_result, quantity_results
from gaitval.metrics.whole_body import record_centre_of_mass
from gaitval.model.ground import LEVEL, Ground

if TYPE_CHECKING:
    from gaitval.subjects.subject import Subject


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


_PHASE = np.arange(1000) / 1000


def consistency(record: GaitRecord) -> Consistency:
    """The contradictions in `record`; the module's docstring derives the bounds."""
    mean = sum(
        (record.ground_reaction(side, _PHASE).mean(axis=0) for side in SIDES), start=np.zeros(3)
    )
    # |1 − m| of the module's docstring, for each axis
    missing = np.abs(LEVEL.up - mean)
    # √s_r + √s_l
    stance = sum(np.sqrt(record.stance_fraction[side]) for side in SIDES)
    asymmetry = {}
    for name in MomentAsymmetry.model_fields:
        difference = record.moments[f"{name}_r"](_PHASE) - record.moments[f"{name}_l"](_PHASE)
        asymmetry[name] = Asymmetry(
            mean_difference=float(difference.mean()),
            rms_difference=float(np.sqrt(np.mean(difference**2))),
        )
    return Consistency(
        mean_force=_components(mean),
        force_rmse_bound=_components(0.5 * missing),
        vertical_rmse_bound_in_stance=float(missing[2] / stance),
        moment_asymmetry=MomentAsymmetry(**asymmetry),
    )


def _components(force: Array) -> ForceComponents:
    forward, left, vertical = map(float, force)
    return ForceComponents(forward=forward, left=left, vertical=vertical)
