"""How much of an estimate's error insoles leave: they say how much each foot carries.

Counted in people who were estimated from others, with insoles as good as their own plates, so these
are upper bounds. Of the other curves little is left out, as most of what is missed there is one arm
of the vertical force at each joint.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array


class MissedPerson(NamedTuple):
    """A person whose kinetics were estimated from others.

    Attributes
    ----------
    missed : (2, 7, n) `KINETICS`, right and left, each over its own cycle: the truth less the
        estimate.
    truth : (2, 7, n).
    """

    missed: Array
    truth: Array


def left_by_insoles(people: Sequence[MissedPerson]) -> Array:
    """(7,) RMS error that is left over the error before; the vertical force is the last."""
    before = np.sqrt(np.mean([np.square(each.missed) for each in people], axis=(0, 1, 3)))
    rest = [_without_vertical(each, before[-1]) for each in people]
    # where a recording makes a curve no nearer it would not be used
    left = np.sqrt(np.mean(np.square(rest), axis=(0, 1, 3))) / before
    return np.asarray(np.minimum(left, 1.0))


def per_vertical(kinetics: Array, noise: float) -> Array:
    """(2, 7, n) `kinetics` over the vertical force, the last of them: arms of moments, slopes of
    the other forces; less where that force is as small as the `noise`.
    """
    vertical = kinetics[:, -1:]
    return np.asarray(kinetics * vertical / (vertical**2 + noise**2))


def _without_vertical(of: MissedPerson, noise: float) -> Array:
    """What is missed when the vertical force on each foot is known at each instant: the other
    curves stay what they are estimated `per_vertical`.
    """
    rest: Array = of.missed - per_vertical(of.truth - of.missed, noise) * of.missed[:, -1:]
    rest[:, -1] = 0.0
    return rest
