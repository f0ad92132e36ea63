"""What one more recording of a person would be worth to an estimate: how much of its error is left.

Counted in people who were estimated from others, with the recording as good as their own plates, so
these are upper bounds. Measured, not learned, is what an estimate lacks most: one arm of the
vertical force at each joint, which a foot on a plate once shows, and how much both feet carry
together. Insoles say how much each foot carries: of the other curves little, as most of what is
missed there is the arm (`python -m claims elsewhere.worth`).
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array

LEVERS: Final = "arms"
TOTAL: Final = "total"
INSOLES: Final = "insoles"


class MissedPerson(NamedTuple):
    """A person whose kinetics were estimated from others.

    Attributes
    ----------
    missed : (2, 7, n) `KINETICS`, right and left, each over its own cycle: the truth less the
        estimate.
    truth : (2, 7, n).
    left_phase : of the right cycle at which the left foot lands.
    """

    missed: Array
    truth: Array
    left_phase: float


def left_over(people: Sequence[MissedPerson], forces: int) -> dict[str, Array]:
    """(7,) RMS error that is left over the error before, by what more is recorded. The kinetics
    begin with the moments, and end with as many `forces`, the vertical one last.
    """
    before = np.sqrt(np.mean([np.square(each.missed) for each in people], axis=(0, 1, 3)))
    rests = {
        INSOLES: [_without_vertical(each, before[-1]) for each in people],
        LEVERS: [_without_arms(each, forces) for each in people],
        TOTAL: [_without_total(each, forces) for each in people],
    }
    return {
        # where a recording makes a curve no nearer it would not be used
        name: np.minimum(np.sqrt(np.mean(np.square(rest), axis=(0, 1, 3))) / before, 1.0)
        for name, rest in rests.items()
    }


def per_vertical(kinetics: Array, noise: float) -> Array:
    """(2, 7, n) `kinetics` over the vertical force, the last of them: arms of moments, slopes of
    the other forces; less where that force is as small as the `noise`.
    """
    vertical = kinetics[:, -1:]
    return np.asarray(kinetics * vertical / (vertical**2 + noise**2))


def _without_arms(of: MissedPerson, forces: int) -> Array:
    """What is missed when the arm of the vertical force at each joint and side is known."""
    rest, vertical = of.missed.copy(), of.truth[:, -1:]
    moments = rest[:, :-forces]
    arms = np.sum(moments * vertical, axis=2) / np.sum(vertical**2, axis=2)
    moments -= arms[..., None] * vertical
    return rest


def _without_vertical(of: MissedPerson, noise: float) -> Array:
    """What is missed when the vertical force on each foot is known at each instant: the other
    curves stay what they are estimated `per_vertical`.
    """
    rest: Array = of.missed - per_vertical(of.truth - of.missed, noise) * of.missed[:, -1:]
    rest[:, -1] = 0.0
    return rest


def _without_total(of: MissedPerson, forces: int) -> Array:
    """What is missed when the force on both feet is known at each instant: of what is lacking, each
    foot has its share of the vertical force that is estimated.
    """
    rest, samples = of.missed.copy(), of.missed.shape[2]
    later = round(of.left_phase * samples)
    # the left foot in the time of the right one's cycle; its medial force is the other way
    carried = np.maximum((of.truth - of.missed)[:, -1], 0.0)
    carried[1] = np.roll(carried[1], later)
    share = carried / np.maximum(carried.sum(axis=0), 0.01)
    for i in range(rest.shape[1] - forces, rest.shape[1]):
        mirror = -1.0 if i == rest.shape[1] - 2 else 1.0
        right, left = of.missed[0, i], np.roll(of.missed[1, i], later)
        lacks = right + mirror * left
        rest[0, i] = right - share[0] * lacks
        rest[1, i] = np.roll(left - mirror * share[1] * lacks, -later)
    return rest
