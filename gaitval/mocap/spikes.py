"""Whether a marker leaves its path."""

from typing import Final

import numpy as np

from gaitval.arrays import Array

LARGEST_ACCELERATION: Final = 150.0
"""m/s². No marker of a walking person exceeds this between neighbouring frames: the largest is 153
in the walks of Rajagopal et al. 2016 (toe, 100 Hz) and 128 in WBDS at 1.26 m/s, both mostly noise,
for which `JUMP_NOISE` is added."""
JUMP_NOISE: Final = 0.006
"""m. What camera noise may add to a second difference (2.4 times the noise itself)."""
NOISE_MULTIPLE: Final = 4.0
"""In a noisy trial its own noise is used instead: this many medians of a marker's second
differences, which is 6 standard deviations of noise in three directions and so never exceeded."""


def jump_tolerance(path: Array, rate: float, frames: int = 1) -> float:
    """Largest distance, m, that a marker with the `path` (T, 3) m, NaN where not seen, at `rate` Hz
    may be from where its velocity, extrapolated over so many `frames`, would take it.
    """
    usual = surprise_of(path)
    # 0 stands for unknown.
    usual = usual[usual > 0.0]
    noise = NOISE_MULTIPLE * float(np.median(usual)) if len(usual) else 0.0
    # Over a time step dt an acceleration a makes a second difference of a dt².
    return max(JUMP_NOISE, noise) + LARGEST_ACCELERATION * (frames / rate) ** 2


def surprise_of(path: Array) -> Array:
    """Distance (T,) m of a marker with the `path` (T, 3) m, NaN where not seen, from where its last
    velocity points; 0 where this frame or one of the two before it is not seen.
    """
    distance = np.zeros(len(path))
    if len(path) > 2:
        # Second difference: x₂ less its extrapolation x₁ + (x₁ − x₀).
        distance[2:] = np.linalg.norm(path[2:] - 2.0 * path[1:-1] + path[:-2], axis=1)
    return np.nan_to_num(distance)


def jumps(markers: Array, rate: float) -> bool:
    """Whether any of `markers` (T, M, 3), m at `rate` Hz, leaves its path; NaN where not seen."""
    for column in range(markers.shape[1]):
        path = markers[:, column]
        tolerance = jump_tolerance(path, rate)
        # backwards, too: the start of the trial or of a block hides a spike
        if any((surprise_of(view) > tolerance).any() for view in (path, path[::-1])):
            return True
    return False
