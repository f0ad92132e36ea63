"""How far the skill of walks may be by the choice of people."""

from typing import Final

import numpy as np

from gaitval.arrays import Array

DRAWS: Final = 10_000
SEED: Final = 36


def skill_interval(ours: Array, guess: Array) -> tuple[float, float]:
    """The 90 % interval of the skill, 1 - error / error of the guess, by drawing people with
    replacement. The errors (people,) have one unit; those of several curves are their mean.
    """
    draws = np.random.default_rng(SEED).integers(len(ours), size=(DRAWS, len(ours)))
    skills = 1.0 - ours[draws].mean(axis=1) / guess[draws].mean(axis=1)
    low, high = np.quantile(skills, [0.05, 0.95])
    return float(low), float(high)
