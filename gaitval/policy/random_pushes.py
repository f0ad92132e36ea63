"""Pushes that a training draws at random."""

import numpy as np

from gaitval.configuration import EnvironmentSettings

SIDEWAYS = (np.deg2rad(45.0), np.deg2rad(100.0))
"""Range of directions of every other push of a training, rad from straight ahead, left or right. It
reaches a little beyond the tested pushes, so that these are not at the edge of what was learned."""


def random_push(
    random: np.random.Generator,
    constants: EnvironmentSettings,
    difficulty: float,
    earliest: float,
    latest: float,
) -> tuple[float, float, float]:
    """A push as `WalkingEnvironment` takes it: phase, force N, direction rad.

    Parameters
    ----------
    random : draws it.
    constants : ranges of its force.
    difficulty : 0 to 1, the fraction of that range.
    earliest, latest : phases between which it starts.
    """
    # Every other push is drawn from the smaller range, see `push_focus`. The order of the draws
    # is part of a result: in another order every seed gives another training.
    focused = random.uniform() < 0.5
    largest = constants.push_focus if focused else constants.push_force
    return (
        random.uniform(earliest, latest),
        difficulty * random.uniform(0.0, largest),
        _random_direction(random),
    )


def _random_direction(random: np.random.Generator) -> float:
    """Uniform over the forward half, or every other time over the sides, where pushes are hardest
    to survive.
    """
    if random.uniform() < 0.5:
        return float(random.uniform(-0.5 * np.pi, 0.5 * np.pi))
    side = 1.0 if random.uniform() < 0.5 else -1.0
    return side * float(random.uniform(*SIDEWAYS))
