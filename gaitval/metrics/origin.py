"""Where the reference side of a comparison comes from: only recorded data judge a walk.

A walk may also be compared with a prediction, with the other leg's curves, or with what is expected
from other people. Such a difference is a distance: it does not show how accurate the walk is, so it
has no verdict, goal or skill anywhere.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal, get_args

from gaitval.configuration import Configuration, RecordSettings
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import Origin
from gaitval.metrics.side_measures import SIDE_MEASURES
from gaitval.quantities import QUANTITIES as QUANTITY_TABLE
from gaitval.subjects.prediction.known import (
    QUANTITIES,
    RecordedQuantity,
    is_unrecorded,
    quantities_known,
    quantities_recorded,
)
from gaitval.subjects.subject import Subject

if TYPE_CHECKING:
    from gaitval.subjects.subject import Subject

ORIGINS: Final[tuple[Origin, ...]] = ("recorded", "mirrored", "expected", "predicted")
"""Each is further from a record than the one before."""

Origins = Mapping[RecordedQuantity, Mapping[Side, Origin]]
"""Of each quantity of the record, on each side."""

_KINDS: Final[Mapping[RecordedQuantity, Literal["angles", "kinetics", "stance"]]] = {
    "angles": "angles",
    "moments": "kinetics",
    "forces": "kinetics",
    "stance": "stance",
}
"""What `Subject.origin` calls the quantities that a side may lack; timing is of both sides."""

_BOTH_SIDES: Final = (
    "centre_of_mass_rmse",
    "epsilon",
    "speed_error",
    "stride_time_error",
    "step_width_error",
)
"""Measures of the whole body: their targets are a walk or an axis ("left"), no side."""


def record_origins(
    subject: "Subject", settings: RecordSettings
) -> dict[RecordedQuantity, dict[Side, Origin]]:
    """Where the reference of a walk comes from: `subject` on the trial it is compared with, in a
    run with `settings`. At a speed that was not recorded everything is predicted.
    """
    if is_unrecorded(settings):
        return everything("predicted")
    known = quantities_recorded(subject)
    found: dict[RecordedQuantity, dict[Side, Origin]] = {
        quantity: dict[Side, Origin].fromkeys(
            SIDES, "recorded" if quantity in known else "expected"
        )
        for quantity in QUANTITIES
    }
    for quantity, kind in _KINDS.items():
        for side in SIDES:
            if quantity in known:
                found[quantity][side] = subject.origin(side, kind)
    return found


def everything(origin: Origin) -> dict[RecordedQuantity, dict[Side, Origin]]:
    """The same `origin` for all quantities of both sides."""
    return {quantity: dict[Side, Origin].fromkeys(SIDES, origin) for quantity in QUANTITIES}


def furthest(found: Sequence[Origin]) -> Origin:
    """The origin in `found` furthest from a record: a comparison is as good as its worst part."""
    return max(found, key=ORIGINS.index)


def measure_origin(measure: str, target: str, origins: Origins) -> Origin | None:
    """Where the reference of a `measure` on a `target` (see `tolerances.Measure`) comes from, by
    the `origins` of the record; None for a measure that needs no record, such as falls.
    """
    of = QUANTITIES_OF.get(measure, ())
    if not of:
        return None
    sides = SIDES if measure in _BOTH_SIDES else _sides(target)
    return furthest([origins[quantity][side] for quantity in of for side in sides])


def _sides(target: str) -> tuple[Side, ...]:
    """The side that a target names ("left", "knee_angle_l"); both if it names none."""
    # a curve ends in _r or _l; a speed or axis names no side
    return tuple(s for s in SIDES if target == s or target.endswith(f"_{s[0]}")) or SIDES


def curve_origin(kind: str, name: str, origins: Origins) -> Origin:
    """The origin of a curve by the `origins` of the record; `kind` and `name` as in `metrics.json`,
    such as "moments" and "knee_angle_r".
    """
    quantity = next(each for each in QUANTITIES if each == kind)
    return furthest([origins[quantity][side] for side in _sides(name)])


def is_judged(origin: Origin | None) -> bool:
    """Whether `origin` allows a verdict or skill: recorded, or no record needed (None)."""
    return origin in (None, "recorded")


def not_recorded(origins: Origins) -> list[tuple[RecordedQuantity, Side, Origin]]:
    """Quantity, side and origin of everything in `origins` that was not recorded."""
    return [
        (quantity, side, origins[quantity][side])
        for quantity in QUANTITIES
        for side in SIDES
        if origins[quantity][side] != "recorded"
    ]


Status = Literal["fitted", "partly fitted", "predicted", "not compared"]

ReadBy = Literal["reference", "feed-forward", "reward", "identification", "correction"]
"""What a run uses a known quantity for. Scaling uses standing markers or lengths, and no gait."""

_READ_BY: Final[Mapping[RecordedQuantity, tuple[ReadBy, ...]]] = {
    "angles": ("reference", "reward", "identification", "correction"),
    "timing": ("reference", "reward", "identification"),
    "moments": get_args(ReadBy),
    "forces": ("reference", "reward", "identification", "correction"),
    "stance": ("reference",),
}

QUANTITIES_OF: Final[Mapping[str, tuple[RecordedQuantity, ...]]] = {
    "angle_rmse": ("angles",),
    "angle_skill": ("angles",),
    "moment_rmse": ("moments",),
    "moment_rmse_as_measured": ("moments",),
    "moment_rmse_own_hips": ("moments",),
    "moment_skill": ("moments",),
    "force_rmse": ("forces",),
    "force_rmse_as_measured": ("forces",),
    "force_skill": ("forces",),
    "unfiltered_force_rmse": ("forces",),
    **{measure.name: each.needs for each in QUANTITY_TABLE for measure in each.measures},
    "centre_of_mass_rmse": ("forces",),
    **{each.name: each.quantities for each in SIDE_MEASURES},
    "speed_error": ("timing",),
    "stride_time_error": ("timing",),
    "step_length_error": ("timing",),
    "step_width_error": ("timing",),
    "stance_fraction_error": ("stance",),
    "epsilon": ("angles", "moments", "forces"),
}
"""Recorded quantities that a measure is compared with; the others have no record."""


def uses(
    subject: Subject, configuration: Configuration, *, trained: bool
) -> dict[str, list[ReadBy]]:
    """What reads each quantity of the compared record of `subject` before the comparison; nothing
    reads those that `configuration` keeps from the run, and no reward if nothing was `trained`.
    """
    known_quantities = quantities_known(subject, configuration.record)
    idle: dict[ReadBy, bool] = {
        "reward": not trained,
        "identification": configuration.identification.method == "none",
        "correction": configuration.correction.steps == 0,
    }
    return {
        quantity: [
            by for by in _READ_BY[quantity] if quantity in known_quantities and not idle.get(by)
        ]
        for quantity in QUANTITIES
    }


def status(measure: str, known_quantities: Collection[str]) -> Status:
    """Whether `measure` is compared with quantities known to the run, which are
    `known_quantities`.
    """
    of = QUANTITIES_OF.get(measure, ())
    if not of:
        return "not compared"
    known = [quantity in known_quantities for quantity in of]
    return "fitted" if all(known) else "partly fitted" if any(known) else "predicted"
