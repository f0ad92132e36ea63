"""The least that a hip can carry: whatever muscles do, with the moments that are asked of them.

Which cost people keep small is not known, and most of a contact force hangs on it. What cannot hang
on it is the smallest force that any sharing of the same moments has, in a body with these muscles:
a convex problem, too. Passive forces and the limits of muscles are in it, limits of how fast
activations change are not.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.musculature.forces import LegForces, share_leg
from gaitval.musculature.gait import LoadedMotion, MuscleGait
from gaitval.musculature.paths import geometry, table
from gaitval.musculature.sharing import Criterion

NEARLY_NOTHING: Final = 1e-3
"""Weight of an activation's square beside that of the hip's force in body weights: between 1e-2 and
1e-4 the least force is the same to .005 body weights in ten walkers."""

LEAST: Final = Criterion(
    "least hip force", weights=dict.fromkeys(table().names, NEARLY_NOTHING), hip=1.0
)


def least_hip_leg(time: Array, leg: LegForces, mass: float) -> LegForces:
    """The `leg` of a body of `mass` kg at `time` (T,) s with the sharing of its loads that presses
    the hip least.
    """
    return share_leg(time, leg.loads, geometry(leg.loads.angles), leg.muscles, LEAST, mass)


def least_hip(found: MuscleGait, motions: Sequence[LoadedMotion]) -> dict[Side, Array]:
    """(101,) body weights over the gait cycle, by side: the least hip contact force of any sharing
    of the moments of `found`, which is of `motions`; mean of all cycles. Sides without a hip's
    force, or a whole cycle, are left out.
    """
    cycles: Mapping[tuple[str, Side], Sequence[tuple[float, float]]] = {
        (motion.name, side): spans for motion in motions for side, spans in motion.cycles.items()
    }
    curves: dict[Side, list[Array]] = {}
    for name, side, piece in found.pieces:
        if side not in found.legs or "hip" not in found.legs[side].contact:
            continue
        least = least_hip_leg(piece.time, piece.legs[side], piece.mass_kg).contact.size("hip")
        curves.setdefault(side, []).extend(
            np.interp(np.linspace(start, end, 101), piece.time, least) / piece.body_weight
            for start, end in cycles.get((name, side), ())
            if piece.time[0] <= (start + end) / 2 <= piece.time[-1]
        )
    return {side: np.mean(each, axis=0) for side, each in curves.items() if each}
