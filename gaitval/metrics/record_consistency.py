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

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.record import GaitRecord
from gaitval.metrics.typed import Number, Result, Size

_BODY_WEIGHTS = (0.0, 0.0, 1.0)
"""Mean ground reaction of steady walking: forward, left, vertical."""
_PHASE = np.arange(1000) / 1000


class ForceComponents(Result):
    """Body weights, by world axis."""

    forward: Number
    left: Number
    vertical: Number


class Asymmetry(Result):
    """Difference of a moment of both legs over each side's own cycle, Nm/kg."""

    mean_difference: Number
    """Right less left."""
    rms_difference: Size
    """Root mean square of right less left."""


class MomentAsymmetry(Result):
    """Of the sagittal moments."""

    hip_flexion: Asymmetry
    knee_angle: Asymmetry
    ankle_angle: Asymmetry

    def by_name(self) -> dict[str, Asymmetry]:
        """The moments, in the order of their names."""
        return dict(sorted(self))


class Consistency(Result):
    """What a record contradicts."""

    mean_force: ForceComponents
    """Mean over the gait cycle of the ground reaction under both feet; 0, 0, 1 in steady
    walking."""
    force_rmse_bound: ForceComponents
    """RMSE, averaged over both feet, that no steady walk can be below."""
    vertical_rmse_bound_in_stance: Size
    """Body weights: the same of the worse foot where no simulated foot is loaded in the recorded
    swing."""
    moment_asymmetry: MomentAsymmetry


def consistency(record: GaitRecord) -> Consistency:
    """The contradictions in `record`; the module's docstring derives the bounds."""
    mean = sum(
        (record.ground_reaction(side, _PHASE).mean(axis=0) for side in SIDES), start=np.zeros(3)
    )
    # |1 − m| of the module's docstring, for each axis
    missing = np.abs(np.array(_BODY_WEIGHTS) - mean)
    # √s_r + √s_l
    stance = sum(np.sqrt(record.stance_fraction[side]) for side in SIDES)
    asymmetry = {}
    for name in MomentAsymmetry.model_fields:
        difference = record.moments[f"{name}_r"](_PHASE) - record.moments[f"{name}_l"](_PHASE)
        asymmetry[name] = Asymmetry(
            mean_difference=float(difference.mean()),
            rms_difference=float(np.sqrt(np.mean(difference**2))),
        )
    return Consistency(
        mean_force=_components(mean),
        force_rmse_bound=_components(0.5 * missing),
        vertical_rmse_bound_in_stance=float(missing[2] / stance),
        moment_asymmetry=MomentAsymmetry(**asymmetry),
    )


def _components(force: Array) -> ForceComponents:
    forward, left, vertical = map(float, force)
    return ForceComponents(forward=forward, left=left, vertical=vertical)
