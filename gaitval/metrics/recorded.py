"""The record's part of `metrics.json`: the curves that a walk is compared with, in its units."""

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import Curves, recorded_curves, rms
from gaitval.metrics.joint_power import JointPower, joint_power
from gaitval.metrics.record_consistency import consistency
from gaitval.metrics.whole_body import record_centre_of_mass

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject

Json = dict[str, Any]

CURVE_UNITS = {"angles": "deg", "moments": "Nm/kg", "forces": "% BW"}
"""Units of the curves and their errors in `metrics.json`."""
_SCALE = {"angles": 180.0 / math.pi, "moments": 1.0, "forces": 100.0}

KINETICS = ("moments", "forces")
"""The kinds of curves that force plates have a part in."""


def by_kind(curves: Curves) -> dict[str, dict[str, Any]]:
    """The curves of each kind in the units of `CURVE_UNITS`."""
    return {
        kind: {name: curve * scale for name, curve in getattr(curves, kind).items()}
        for kind, scale in _SCALE.items()
    }


def recorded_part(record: GaitRecord, subject: "Subject | None" = None) -> Json:
    """The record's part of `metrics.json`; `subject` tells what was corrected in it."""
    phase = np.arange(1000) / 1000
    stride = record.speed * record.stride_time
    right_on = phase <= record.stance_fraction["right"]
    left_on = (phase - record.left_phase) % 1.0 <= record.stance_fraction["left"]
    curves = recorded_curves(record)
    plates = None if subject is None else subject.plates
    measured = None
    if subject is not None and plates is not None:
        kinds = by_kind(recorded_curves(subject.measured()))
        measured = {kind: kinds[kind] for kind in KINETICS}
    return {
        "curves": by_kind(curves),
        "joint_power": asdict(_power(record, curves)),
        "centre_of_mass": record_centre_of_mass(record),
        "plates": None if plates is None else plates.model_dump(),
        "as_measured": measured,
        "spatiotemporal": {
            "walking_speed": record.speed,
            "cadence": 120.0 / record.stride_time,
            "stride_time_right": record.stride_time,
            "stride_time_left": record.stride_time,
            "stance_fraction_right": record.stance_fraction["right"],
            "stance_fraction_left": record.stance_fraction["left"],
            "double_support_fraction": float((right_on & left_on).mean()),
            # both feet land equally far ahead of the body: see tolerances.toml, step-length
            "step_length_right": stride * (1.0 - record.left_phase),
            "step_length_left": stride * record.left_phase,
        },
        "left_phase": record.left_phase,
        "consistency": consistency(record).as_dict(),
    }


def _power(record: GaitRecord, curves: Curves) -> JointPower:
    """Joint power of the record, from its `curves`."""
    found = joint_power(curves, dict.fromkeys("rl", record.stride_time))
    assert found is not None  # a record has a cycle
    return found


def kinetics(curves: Curves) -> dict[str, Array]:
    """Moments and forces together, for `whole_body_measures`."""
    return {**curves.moments, **curves.forces}


def errors_as_measured(curves: Json, measured: Json | None) -> Json | None:
    """RMSE of mean curves from the record before its plates were corrected."""
    if measured is None:
        return None
    return {
        kind: {
            name: None if curve["mean"] is None else rms(curve["mean"] - measured[kind][name])
            for name, curve in curves[kind].items()
        }
        for kind in KINETICS
    }
