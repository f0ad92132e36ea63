"""What sound recordings show: means and spreads of the data of `balance`.

Those of the data are of 33 recordings of 25 people of three laboratories: children and adolescents
of McGill and Shriners, Montreal; people of Basel, mostly children, who walk faster and have no
standing trials; one adult of Stanford. A script of version 0.2 printed them
(`measurement_constants` at commit 60ee3cba).
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array

HALF_STRIDE: Final[Mapping[str, tuple[float, ...]]] = {
    "force x": (0.023, -0.019, 0.006, 0.014, 0.001, -0.016, -0.025, -0.016, 0.006, 0.031),
    "force y": (-0.022, -0.012, 0.001, 0.007, 0.009, -0.006, 0.001, 0.001, -0.007, -0.005),
    "force z": (0.027, -0.001, 0.022, 0.030, 0.011, 0.011, -0.006, -0.013, -0.013, -0.042),
    "moment x": (-0.003, -0.002, 0.003, 0.008, 0.007, 0.003, 0.004, 0.002, -0.007, -0.012),
    "moment y": (0.028, 0.024, 0.019, 0.016, 0.013, 0.015, 0.016, 0.014, 0.018, 0.041),
    "moment z": (-0.001, 0.001, -0.001, -0.003, -0.002, -0.002, -0.001, -0.002, -0.005, -0.005),
}
"""What the plates show too much in tenths of half a stride: what filters, soft tissue and the
masses of the segments leave. The second half has the opposite sign where `ODD`. All but the mean of
"moment y", the place of the centre of mass, is for a walk whose acceleration is `ACCELERATION`."""
ACCELERATION: Final = 0.20
"""Root mean square of the horizontal and vertical acceleration of the centre of mass, over
gravity."""
LEAST_ACCELERATION: Final = 0.02
"""A body that hardly moves is taken to move this much."""
ODD: Final = frozenset(("force y", "moment x", "moment z"))
SPREAD: Final[Mapping[str, tuple[float, ...]]] = {
    "force x": (0.018, 0.021, 0.017, 0.017, 0.012, 0.011, 0.011, 0.017, 0.017, 0.023),
    "force y": (0.015, 0.014, 0.015, 0.014, 0.011, 0.010, 0.011, 0.014, 0.014, 0.012),
    "force z": (0.039, 0.031, 0.025, 0.018, 0.015, 0.020, 0.017, 0.020, 0.025, 0.040),
    "moment x": (0.007, 0.007, 0.007, 0.006, 0.005, 0.004, 0.005, 0.006, 0.008, 0.010),
    "moment y": (0.014, 0.013, 0.012, 0.011, 0.010, 0.009, 0.008, 0.009, 0.012, 0.013),
    "moment z": (0.004, 0.002, 0.002, 0.001, 0.001, 0.003, 0.004, 0.005, 0.006, 0.005),
}
"""SD of a person's own pattern beside that mean, from bin to bin of the stride."""
FALLS: Final = {"fall of force": (-0.75, 0.5), "fall of markers": (-2.4, 0.7)}
"""Mean and SD of `balance.FALL`, octaves."""
STRIDE_LENGTH: Final = 0.05
"""Correlation length of that pattern, strides: neighbouring bins correlate by 0.3."""
PRESSURE_MEAN: Final[Mapping[str, tuple[float, ...]]] = {
    "pressure along": (0.0015, 0.0152, 0.0320, 0.0505, 0.0630, 0.0704, 0.0730, 0.0653),
    "pressure across": (-0.0056, -0.0067, -0.0068, -0.0059, -0.0040, -0.0015, 0.0011, 0.0040),
}
"""Centre of pressure ahead of the ankle's centre, and towards the middle line, over stature, in
tenths of the stance from 10 to 90 %."""
PRESSURE_SPREAD: Final[Mapping[str, tuple[float, ...]]] = {
    "pressure along": (0.0074, 0.0082, 0.0123, 0.0136, 0.0111, 0.0077, 0.0052, 0.0054),
    "pressure across": (0.0031, 0.0032, 0.0033, 0.0035, 0.0037, 0.0040, 0.0042, 0.0045),
}
STANCE_LENGTH: Final = 0.25
"""Correlation length of a foot's own roll-over, stances."""
OWN_BIN: Final = 0.35
"""Share of that spread which neighbouring bins do not have in common."""
SAME_PERSON: Final = 0.7
"""Correlation of a person's feet, each with its own pattern."""
SAME_FOOT: Final = 0.95
"""Correlation of one foot on two plates."""


LEGS: Final = (0.96, 0.05)
"""Mean and SD of the thigh's and the shank's length over those expected of the stature: seventeen
people of McGill, Stanford, OpenSim and WBDS, children among them."""
NUISANCE: Final[Mapping[str, float]] = {
    "acceleration x": 0.12, "acceleration y": 0.15, "acceleration z": 0.05,
    "turning x": 0.25, "turning y": 0.30, "turning z": 0.45,
    "blur of forces": 0.4, "blur of markers": 0.7,
    "centre of mass x": 0.012, "centre of mass y": 0.005, "centre of mass z": 0.03,
}  # fmt: skip
"""SD of what soft tissue and the masses of the segments do to the body's own balance: of the same
recordings 0.07, 0.12 and 0.04, and 0.12, 0.17 and 0.27, here for other laboratories as well."""
AMPLITUDES: Final = ("acceleration", "turning")
"""Those that are shares of the body's acceleration, which is smaller in a slow walk; soft tissue
moves there as well."""


def relative(acceleration: float) -> float:
    """Of a walk with this acceleration to that of `ACCELERATION`, what its pattern is larger by."""
    return min(acceleration / ACCELERATION, 1.5)


def expected(kind: str, phase: Array, height_m: float, acceleration: float) -> Array:
    """What sound recordings show of a `kind` of datum at `phase`, of a person of `height_m` whose
    walk has this `acceleration` (of `ACCELERATION`).
    """
    if kind in HALF_STRIDE:
        half = np.array(HALF_STRIDE[kind])
        still = half.mean() if kind == "moment y" else 0.0
        half = still + (half - still) * relative(acceleration)
        whole = np.concatenate([half, -half if kind in ODD else half])
        return np.asarray(whole[np.floor(phase * len(whole)).astype(int)])
    if kind in FALLS:
        return np.full(len(phase), FALLS[kind][0])
    if kind not in PRESSURE_MEAN:
        return np.zeros(len(phase))
    mean = np.array(PRESSURE_MEAN[kind])
    return np.asarray(height_m * mean[np.rint((phase - 0.15) * 10).astype(int)])


def spread(kind: str, phase: Array, height_m: float) -> Array:
    """SD of people around that."""
    if kind in SPREAD:
        of = np.array([*SPREAD[kind], *SPREAD[kind]])
        return np.asarray(of[np.floor(phase * len(of)).astype(int)])
    if kind in FALLS:
        return np.full(len(phase), FALLS[kind][1])
    if kind not in PRESSURE_SPREAD:
        return np.zeros(len(phase))
    of = np.array(PRESSURE_SPREAD[kind])
    return np.asarray(height_m * of[np.rint((phase - 0.15) * 10).astype(int)])
