"""How far the curves of a second session of the same person may be off, all of them at once."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array

DRAWS: Final = 2_000
"""Sessions drawn for `at_once`: the 95 % are then known to within .5 %."""


def at_once(session: Sequence[Mapping[str, Array]], between: Mapping[str, Array]) -> float:
    """Standard deviations within which 95 % of sessions are at all points of all curves; `session`
    has what each of its own sources moves, `between` the standard errors of the means. Sides are
    drawn apart, as the landmarks of two legs are.
    """
    random = np.random.default_rng(0)
    largest = np.zeros(DRAWS)
    for suffix in ("_r", "_l"):
        names = sorted({n for of in session for n in of if n.endswith(suffix)} & between.keys())
        if not names:
            continue
        moved = np.array(
            [
                np.concatenate([of.get(n, np.zeros_like(between[n])) for n in names])
                for of in session
                if any(n in of for n in names)
            ]
        )
        cycles = [between[name] for name in names]
        error = np.concatenate(cycles)
        deviation = np.sqrt(np.sum(moved**2, axis=0) + error**2)
        known = deviation > 0.0
        # A mean of cycles is off alike over a curve, or it would not be smooth.
        sizes = np.repeat(np.arange(len(names)), [len(each) for each in cycles])
        drawn = random.standard_normal((DRAWS, len(moved))) @ moved
        drawn += random.standard_normal((DRAWS, len(names)))[:, sizes] * error
        peaks = np.abs(drawn[:, known] / deviation[known]).max(axis=1, initial=0.0)
        largest = np.maximum(largest, peaks)
    return float(np.quantile(largest, 0.95))
