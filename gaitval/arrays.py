"""Array types for annotations, and the runs of True in an array."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.int64]


def runs(on: Flags) -> tuple[Index, Index]:
    """Runs of True in the flags `on` (samples,).

    Returns
    -------
    First sample of each run, and the first sample after it: (runs,) each, in order of time.
    """
    # A zero on either side, so that a run at the first or last sample has both edges; signed bytes,
    # because the difference of truth values has no sign.
    edges = np.diff(np.concatenate(([0], on.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
