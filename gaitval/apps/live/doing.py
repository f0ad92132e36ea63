"""What can be done to the walk, as values; and from the JSON of the page and of a log."""

import math
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.model.parameters import PARAMETERS

LARGEST_PUSH: Final = 1200.0
"""N, of a push: `pushes.largest` of the configuration, beyond which nothing is tested."""
SLOWEST, FULL = 0.05, 1.0
"""Of real time."""


@dataclass(frozen=True)
class PushPelvis:
    """A push on the pelvis, for 50 ms: N forward and to the left."""

    forward: float
    left: float


@dataclass(frozen=True)
class SlipFoot:
    """The ground is slippery where a foot lands next."""

    side: Side


@dataclass(frozen=True)
class TripFoot:
    """Something stops a foot in the middle of its next swing."""

    side: Side


@dataclass(frozen=True)
class SetSpeed:
    """Walk at a speed, m/s, as soon as a person would."""

    value: float


@dataclass(frozen=True)
class ChangeBody:
    """Give a body parameter another value; units as in `model.parameters.PARAMETERS`."""

    name: str
    value: float


@dataclass(frozen=True)
class Restart:
    """Stand on the reference again."""


@dataclass(frozen=True)
class Wear:
    """Put the devices on, or take them off; the person stands on the reference again."""

    on: bool


@dataclass(frozen=True)
class Clock:
    """Go on at a rate of real time, 0 to stand still. It changes when one sees the walk, not the
    walk.
    """

    rate: float


Doing = PushPelvis | SlipFoot | TripFoot | SetSpeed | ChangeBody | Restart | Wear | Clock
KINDS: Final[dict[str, type[Doing]]] = {
    "push": PushPelvis,
    "slip": SlipFoot,
    "trip": TripFoot,
    "speed": SetSpeed,
    "body": ChangeBody,
    "restart": Restart,
    "device": Wear,
    "clock": Clock,
}


def doing_of(values: Any, where: str) -> Doing:
    """The doing that JSON `values` of a message or a line say, `{"do": "push", "forward": 200,
    "left": 0}`; they are not trusted. Raises RecordError, whose message has `where` they stand, if
    it is unknown, incomplete, or out of range.
    """
    kind = KINDS.get(str(values.get("do"))) if isinstance(values, Mapping) else None
    if kind is None:
        raise RecordError(f"{where}: does nothing that is known. Give do: {', '.join(KINDS)}.")
    given = {name: value for name, value in values.items() if name != "do"}
    fields = kind.__dataclass_fields__
    if given.keys() != fields.keys():
        wanted = ", ".join(fields) or "nothing"
        raise RecordError(f"{where}: {values['do']} takes {wanted}, but got {', '.join(given)}.")
    for name, value in given.items():
        if name == "name":
            if value not in PARAMETERS:
                raise RecordError(
                    f"{where}: {value!r} is no body parameter ({', '.join(PARAMETERS)})."
                )
        elif name == "side":
            if value not in SIDES:
                raise RecordError(f"{where}: side is {value!r}; give {' or '.join(SIDES)}.")
        elif name == "on":
            if not isinstance(value, bool):
                raise RecordError(f"{where}: on is {value!r}; give true or false.")
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise RecordError(f"{where}: {name} is {value!r}, which is no number.")
        elif not abs(value) <= sys.float_info.max:  # a whole number may be larger than any float
            raise RecordError(f"{where}: {name} is {str(value)[:20]}; give a finite number.")
        else:
            given[name] = float(value)
    doing: Doing = kind(**given)
    if isinstance(doing, PushPelvis) and math.hypot(doing.forward, doing.left) > LARGEST_PUSH:
        raise RecordError(f"{where}: a push of more than {LARGEST_PUSH:g} N. Push less.")
    if isinstance(doing, Clock) and doing.rate != 0.0 and not SLOWEST <= doing.rate <= FULL:
        raise RecordError(f"{where}: rate is {doing.rate:g}. Give 0, or {SLOWEST:g} to {FULL:g}.")
    return doing


def values_of(doing: Doing) -> dict[str, Any]:
    """As `doing_of` reads it."""
    (name,) = (name for name, kind in KINDS.items() if isinstance(doing, kind))
    return {"do": name, **asdict(doing)}
