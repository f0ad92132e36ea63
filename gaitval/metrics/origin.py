"""Where the other side of a comparison comes from: only what was recorded judges a walk.

A walk may be compared with a prediction of what it was asked to be, with the other leg's curves, or
with what other people lead to expect. Such a difference is a distance. It says nothing of how
accurate the walk is, so that it has no verdict, goal or skill anywhere.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

from gaitval.configuration import RecordSettings
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import Origin
from gaitval.metrics.told_measures import QUANTITIES_OF
from gaitval.prediction.told import QUANTITIES, Quantity, is_unrecorded, quantities_recorded

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject

ORIGINS: Final[tuple[Origin, ...]] = ("recorded", "mirrored", "expected", "predicted")
"""Each is further from a record than the one before."""

Origins = Mapping[Quantity, Mapping[Side, Origin]]
"""Of each quantity of the record, on each side."""

SKILLS: Final = ("angle_skill", "moment_skill", "force_skill")

_KINDS: Final[Mapping[Quantity, Literal["angles", "kinetics", "stance"]]] = {
    "angles": "angles",
    "moments": "kinetics",
    "forces": "kinetics",
    "stance": "stance",
}
"""What `Subject.origin` calls the quantities that a side may lack; timing is of both sides."""

_BOTH_SIDES: Final = ("centre_of_mass_rmse", "epsilon", "speed_error", "stride_time_error")
"""Measures of the whole body: their targets are a walk or an axis ("left"), no side."""


def record_origins(
    subject: "Subject", settings: RecordSettings
) -> dict[Quantity, dict[Side, Origin]]:
    """Where what a walk is compared with comes from.

    Parameters
    ----------
    subject : on the trial that the walk is compared with.
    settings : of the run: at a speed that was not recorded everything is predicted.
    """
    if is_unrecorded(settings):
        return everything("predicted")
    known = quantities_recorded(subject)
    found: dict[Quantity, dict[Side, Origin]] = {
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


def everything(origin: Origin) -> dict[Quantity, dict[Side, Origin]]:
    """The same origin for all quantities of both sides."""
    return {quantity: dict[Side, Origin].fromkeys(SIDES, origin) for quantity in QUANTITIES}


def furthest(found: Sequence[Origin]) -> Origin:
    """The origin that is furthest from a record: a comparison is as good as its worst part."""
    return max(found, key=ORIGINS.index)


def measure_origin(measure: str, target: str, origins: Origins) -> Origin | None:
    """Where what a measure is compared with comes from.

    Parameters
    ----------
    measure, target : as of `tolerances.Measure`.

    Returns
    -------
    origin
        None for a measure that is compared with no record, such as falls.
    """
    of = QUANTITIES_OF.get(measure, ())
    if not of:
        return None
    sides = SIDES if measure in _BOTH_SIDES else _sides(target)
    return furthest([origins[quantity][side] for quantity in of for side in sides])


def _sides(target: str) -> tuple[Side, ...]:
    """The side that a target names ("left", "knee_angle_l"); both if it names none."""
    return tuple(s for s in SIDES if target == s or target.endswith(f"_{s[0]}")) or SIDES


def curve_origin(kind: str, name: str, origins: Origins) -> Origin:
    """Of a curve of the record.

    Parameters
    ----------
    kind, name : as in `metrics.json`: "moments", "knee_angle_r".
    """
    quantity = next(each for each in QUANTITIES if each == kind)
    return furthest([origins[quantity][side] for side in _sides(name)])


def is_judged(origin: Origin | None) -> bool:
    """Whether a verdict, goal or skill may be given: a record is there, or none is needed."""
    return origin in (None, "recorded")


def origins_in(metrics: Mapping[str, Any]) -> Origins:
    """Those that `metrics.json` tells; of an earlier file without them, those that follow from what
    it says was recorded (`results.metrics_from` refuses earlier files of predicted or mirrored
    records).
    """
    found: Origins | None = metrics["record"].get("origins")
    if found is not None:
        return found
    recorded = metrics["recorded"]
    return {
        quantity: dict[Side, Origin].fromkeys(
            SIDES, "recorded" if quantity in recorded else "expected"
        )
        for quantity in QUANTITIES
    }


def is_recorded_at_all(metrics: Mapping[str, Any]) -> bool:
    """Whether anything that the walk is compared with was recorded."""
    found = origins_in(metrics)
    return any("recorded" in sides.values() for sides in found.values())


def not_judged(metrics: Mapping[str, Any]) -> list[tuple[Quantity, Side, Origin]]:
    """What the walk is not judged by, by quantity and side."""
    found = origins_in(metrics)
    return [
        (quantity, side, found[quantity][side])
        for quantity in QUANTITIES
        for side in SIDES
        if found[quantity][side] != "recorded"
    ]
