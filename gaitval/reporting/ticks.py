"""Where an axis has its ticks, and what they are called: round numbers, as matplotlib's choice."""

from typing import Final, NamedTuple

import numpy as np

_STEPS: Final = (1.0, 2.0, 2.5, 5.0, 10.0)
_EXTENDED: Final = (*(0.1 * each for each in _STEPS[:-1]), *_STEPS, 20.0)
_MOST: Final = 9
"""Intervals."""
_NEAR: Final = 1e-10


class Tick(NamedTuple):
    """A tick and its label."""

    at: float
    label: str


def round_ticks(low: float, high: float, space: float) -> list[Tick]:
    """Ticks from `low` to `high` on an axis that has `space` for so many intervals."""
    intervals = max(1, min(_MOST, int(space)))
    size = 10.0 ** np.floor(np.log10((high - low) / intervals))
    wanted = (high - low) / intervals
    steps = [size * each for each in _EXTENDED]
    first = next(index for index, step in enumerate(steps) if step >= wanted * (1.0 - _NEAR))
    at: list[float] = []
    for step in reversed(steps[: first + 1]):
        begin, end = np.ceil(low / step - _NEAR), np.floor(high / step + _NEAR)
        at = [float(index * step) for index in np.arange(begin, end + 1)]
        if len(at) >= 2:
            break
    decimals = _decimals(at)
    return [Tick(each, _number(each, decimals)) for each in at]


def _decimals(places: list[float]) -> int:
    """Digits behind the point with which all `places` can be told and read right."""
    span = max((abs(each) for each in places), default=1.0) or 1.0
    for decimals in range(12):
        if all(abs(round(each, decimals) - each) < 1e-9 * span for each in places):
            return decimals
    return 12


def _number(value: float, decimals: int) -> str:
    return f"{value + 0.0:.{decimals}f}".replace("-", "−")
