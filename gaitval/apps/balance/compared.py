"""A walker's recoveries in the quantities in which people's were published, beside two guesses."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.metrics.balance_walk import BalanceWalk
from gaitval.metrics.foot_placement import (
    TIME_FOR_A_STEP,
    Placement,
    ankle_answer,
    answered,
    placements,
    step_delay,
    steps_to_recover,
)


class Published(NamedTuple):
    """A row of `recoveries.csv`; see there."""

    quantity: str
    low: float | None
    high: float | None
    unit: str
    of: str
    words: str
    source: str
    locator: str

    def inside(self, value: float | None) -> bool:
        """Whether a `value` is within what was published."""
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return value is not None and low <= value <= high


@cache
def published() -> tuple[Published, ...]:
    """All rows."""
    return tuple(map(_published, shipped_table("gaitval.apps.balance", "recoveries.csv").by_name()))


def _published(row: Mapping[str, str]) -> Published:
    bounds = {name: float(row[name]) if row[name] else None for name in ("low", "high")}
    return Published(**dict(row) | bounds)  # type: ignore[arg-type]


class Guessed(NamedTuple):
    """A quantity of the walker, of one who does not react, and of the pendulum; None where it has
    none.
    """

    walker: float | None
    nothing: float | None = None
    pendulum: float | None = None


@dataclass(frozen=True)
class Pushes:
    """Pushed walks beside the plain one.

    Attributes
    ----------
    plain : without a push.
    walks : with one each, of those that did not fall within two steps.
    found : their steps.
    """

    plain: BalanceWalk
    walks: tuple[BalanceWalk, ...]
    found: tuple[tuple[Placement, ...], ...]

    @classmethod
    def of(cls, plain: BalanceWalk, walks: Iterable[BalanceWalk], seconds: float) -> "Pushes":
        """Of `walks` with pushes of so many `seconds`."""
        kept = [
            (walk, tuple(placements(walk, plain, ends=seconds)))
            for walk in walks
            if not (walk.fell and len(walk.after()) < 2)
        ]
        return cls(plain, tuple(w for w, _ in kept), tuple(f for _, f in kept))

    def answers(self) -> list[Placement]:
        """Of each walk the first step that there was time for."""
        first = (answered(each, TIME_FOR_A_STEP) for each in self.found)
        return [each for each in first if each is not None]


def sideways(pushes: Pushes) -> dict[str, Guessed]:
    """By name the quantities of sideways `pushes`."""
    answers = pushes.answers()
    fall = [np.sign(each.extrapolated[1]) for each in answers]
    shifts = [each.foot[1] * sign for each, sign in zip(answers, fall, strict=True)]
    guesses = [each.guess[1] * sign for each, sign in zip(answers, fall, strict=True)]
    first = [steps[0] for steps in pushes.found if steps]
    ankles = [
        each for walk in pushes.walks if (each := ankle_answer(walk, pushes.plain)) is not None
    ]
    needed = [steps_to_recover(each, (1,)) for each in pushes.found]
    return {
        "offset_change": Guessed(
            _percentile(each.offset[1] for each in answers),
            _percentile(each.extrapolated[1] for each in answers),
            _percentile(each.guess[1] - each.extrapolated[1] for each in answers),
        ),
        "foot_shift": Guessed(_largest(shifts), 0.0, _largest(guesses)),
        "step_delay": Guessed(step_delay(first), None, 0.0),
        "ankle_shift": Guessed(_largest([each.shift for each in ankles]), 0.0, 0.0),
        "ankle_delay": Guessed(
            float(np.median([each.delay for each in ankles])) if ankles else None
        ),
        "steps_to_recover": Guessed(
            None if None in needed or not needed else float(max(n or 0 for n in needed)), None, 0.0
        ),
    }


def _percentile(values: Iterable[float]) -> float | None:
    found = [abs(each) for each in values if math.isfinite(each)]
    return float(np.percentile(found, 95.0)) if found else None


def _largest(values: Sequence[float]) -> float | None:
    """Of the largest size, with its sign."""
    found = [each for each in values if math.isfinite(each)]
    return float(max(found, key=abs)) if found else None
