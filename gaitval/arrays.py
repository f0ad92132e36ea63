"""Array types for annotations, and the runs of True in an array."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.int64]


def runs(on: Flags) -> tuple[Index, Index]:
    """First sample of each run of True, and the first sample after it, (n,) each."""
    edges = np.diff(np.concatenate(([0], on.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
