"""Activation of nine groups of muscles over the gait cycle, by sharing the moments of the joints.

See `gaitval.kinetics.musculature`: needs the body, its motion and its loads, so it is worked out
while those are at hand, and stored.
"""

from typing import Final

import numpy as np

from gaitval.kinetics.musculature.gait import GROUPS, MuscleGait
from gaitval.quantities.quantity import FigureTable, Found, Quantity


def muscle_activation(muscles: MuscleGait) -> Found | None:
    """Mean activation of `GROUPS` over the cycles of each side, and its largest value; None without
    a whole cycle.
    """
    curves = {
        f"{group}_{side[0]}": leg.group(group)
        for side, leg in muscles.legs.items()
        for group in GROUPS
    }
    curves = {name: curve for name, curve in curves.items() if np.isfinite(curve).all()}
    if not curves:
        return None
    return Found(curves, {"peak": {name: float(curve.max()) for name, curve in curves.items()}})


MUSCLE_ACTIVATION: Final = Quantity(
    name="muscle_activation",
    title="Muscle activation",
    axis="activation",
    unit="1",
    note="Activation, 0 to 1, with which the muscles make the joint moments at the least cost "
    "(static optimisation). It knows nothing of co-contraction; single muscles are uncertain by "
    "30 to 50 %.",
    needs=("angles", "moments"),
    curves={group: title for group, (title, _) in GROUPS.items()},
    of_muscles=muscle_activation,
    figures={"peak": "1"},
    tables=(
        FigureTable(
            "Largest activation",
            "1",
            2,
            tuple((title, "peak", group) for group, (title, _) in GROUPS.items()),
        ),
    ),
)
