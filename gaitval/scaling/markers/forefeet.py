"""Which places of the forefoot laboratories mark together."""

from typing import Final

import numpy as np

from gaitval.arrays import Array

FOREFOOT: Final = ("MT1", "MT2", "MT5", "Toe")
"""Places of which one marker is taken for another's: a user is asked where no name says which."""

FOREFEET: Final = (
    *(("MT2",),) * 8,
    *(("MT1", "MT2", "MT5"),) * 6,
    *(("MT1", "MT5"),) * 3,
    *(("MT5", "Toe"),) * 2,
    *(("MT2", "MT5"),) * 3,
    *(("MT5",),) * 4,
    *(("MT1", "MT5", "Toe"),) * 2,
    FOREFOOT,
)
"""Which of `FOREFOOT` a foot has in the built-in marker sets (`gaitval.scaling.marker_sets`) and in
the own sets of laboratories on which this was chosen (listed at version 0.2); Plug-in Gait
and Helen Hayes, which half of the laboratories use, count twice. Where there is one, it is between
the toes or on the outer side; where there are two, one is on the outer side."""


def forefeet_excess(alone: Array) -> Array:
    """(16,) what the logarithm of the probability of the places of `FOREFOOT` with a marker, the
    bits of the index, is above the sum of what they have `alone`; 0 for none. Half is by the
    built-in sets, half as if the places had nothing to do with each other.
    """
    bits = (np.arange(1 << len(FOREFOOT))[:, None] >> np.arange(len(FOREFOOT))) & 1
    apart = np.exp(bits @ alone)
    apart /= apart.sum()
    seen = np.zeros(len(bits))
    for names in FOREFEET:
        seen[sum(1 << FOREFOOT.index(name) for name in names)] += 1.0 / len(FOREFEET)
    excess = np.log(0.5 * (seen + apart) / apart)
    return np.asarray(excess - excess[0])
