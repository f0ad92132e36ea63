"""Contradictions in a recorded gait, and the smallest error that any walk must have because of
them.

In steady walking the mean ground reaction over a gait cycle is one body weight upwards and zero
otherwise (the centre of mass has the same velocity a cycle later). If the mean of the record is m
instead of 1, the errors e of both feet, each over its own cycle, have means that add up to 1 − m.
No mean square is below the square of the mean, so

    RMSE_r + RMSE_l ≥ |mean e_r| + |mean e_l| ≥ |1 − m|:  the mean of both is at least |1 − m| / 2.

If no simulated foot is loaded in the recorded swing, the error of a foot is confined to its stance,
the fraction s of the cycle. Then mean e² ≥ (mean e)² / s (Cauchy and Schwarz), so RMSE ≥ |mean e| /
√s and the larger of both is at least |1 − m| / (√s_r + √s_l), which is reached by an error that is
constant in stance and shared in proportion to √s.

A symmetric walker, with the same τ on both sides, is at best half the difference away from each:
RMSE_r² + RMSE_l² ≥ rms(R − L)² / 2 for recorded curves R and L, with equality for their mean, so
the root mean square of both errors is at least rms(R − L) / 2. A walker may be asymmetric: this is
how much its legs would have to differ to follow the record.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.gait.record import GaitRecord

_COMPONENTS = ("forward", "left", "vertical")
_BODY_WEIGHTS = (0.0, 0.0, 1.0)
"""Mean ground reaction of steady walking, in the order of `_COMPONENTS`."""
_MOMENTS = ("hip_flexion", "knee_angle", "ankle_angle")
_PHASE = np.arange(1000) / 1000


@dataclass(frozen=True)
class Asymmetry:
    """How a curve of the right leg differs from the left one's over each side's own cycle.

    Attributes
    ----------
    mean_difference : right less left.
    rms_difference : root mean square of right less left.
    """

    mean_difference: float
    rms_difference: float


@dataclass(frozen=True)
class Consistency:
    """Contradictions in a record.

    Attributes
    ----------
    mean_force : mean over the gait cycle of the ground reaction under both feet, body weights, by
        world axis: forward, left, vertical.
    force_rmse_bound : by the same names, body weights: the RMSE of steady walking, averaged over
        both feet, cannot be below it.
    vertical_rmse_bound_in_stance : body weights: the same for the worse foot if no simulated foot
        is loaded in the recorded swing.
    moment_asymmetry : Nm/kg, of the sagittal moments.
    """

    mean_force: dict[str, float]
    force_rmse_bound: dict[str, float]
    vertical_rmse_bound_in_stance: float
    moment_asymmetry: dict[str, Asymmetry]

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, to be written as JSON."""
        return asdict(self)


def consistency(record: GaitRecord) -> Consistency:
    """The contradictions in a record; the module's docstring derives the bounds."""
    mean = sum(record.ground_reaction(side, _PHASE).mean(axis=0) for side in SIDES)
    missing = np.abs(np.array(_BODY_WEIGHTS) - mean)
    stance = sum(np.sqrt(record.stance_fraction[side]) for side in SIDES)
    asymmetry = {}
    for name in _MOMENTS:
        difference = record.moments[f"{name}_r"](_PHASE) - record.moments[f"{name}_l"](_PHASE)
        asymmetry[name] = Asymmetry(
            float(difference.mean()), float(np.sqrt(np.mean(difference**2)))
        )
    return Consistency(
        mean_force=dict(zip(_COMPONENTS, map(float, mean), strict=True)),
        force_rmse_bound=dict(zip(_COMPONENTS, map(float, 0.5 * missing), strict=True)),
        vertical_rmse_bound_in_stance=float(missing[2] / stance),
        moment_asymmetry=asymmetry,
    )
