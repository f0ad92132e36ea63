"""Force in the Achilles tendon: the plantarflexion moment over the tendon's moment arm.

All of the moment is taken to be the tendon's. What the other plantarflexors carry would make the
force less, what dorsiflexors pull against it more.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.gait.cycle_curves import Curves
from gaitval.quantities.quantity import (
    Compared,
    Figures,
    FigureTable,
    Found,
    OverTime,
    Quantity,
    QuantityMeasure,
    StrideTimes,
)

ARM: Final[Mapping[float, float]] = {-10.0: 0.0369, 20.0: 0.0346}
"""m, the arm at ankle angles at which it was measured, deg of dorsiflexion; between them it is a
line, and beyond them as at the nearer one, both of which is convention. Largest at 10° of
plantarflexion, and at 20° of dorsiflexion, mean of ten men, SD 2 mm, measured at rest by ultrasound
and motion capture (Manal, Cowder and Buchanan 2013, Physiol Rep 1:e00139, abstract). It is not
scaled to the person. Contracted, it was up to 3 % longer."""


def moment_arm(ankle: Array) -> Array:
    """Of the tendon about the ankle, m, at angles `ankle`, rad, dorsiflexion positive."""
    return np.asarray(np.interp(np.degrees(ankle), list(ARM), list(ARM.values())))


def tendon_force(ankle: Array, moment: Array) -> Array:
    """Force in the tendon at angles `ankle`, rad, with the ankle's `moment`, both dorsiflexion
    positive: in N from Nm, in N/kg from Nm/kg. A tendon does not push: it is 0 where the moment
    dorsiflexes.
    """
    return np.asarray(np.clip(-moment, 0.0, None) / moment_arm(ankle))


def _of_curves(curves: Curves, _: StrideTimes) -> Found | None:
    forces = {}
    for side in "rl":
        name = f"ankle_angle_{side}"
        if name not in curves.angles or name not in curves.moments:
            continue
        angle, moment = np.atleast_2d(curves.angles[name]), np.atleast_2d(curves.moments[name])
        if len(angle) == 0:  # a walk without a whole cycle of this side
            return None
        # of each cycle, and then the mean: it does not follow from mean curves
        forces[f"achilles_{side}"] = tendon_force(angle, moment).mean(axis=0) / GRAVITY
    return Found(forces, _figures(forces)) if forces else None


def _figures(forces: Mapping[str, Array]) -> Figures:
    return {"peak": {name: _peak(force) for name, force in forces.items()}}


def _peak(force: Array) -> float | None:
    return float(force.max()) if np.isfinite(force).all() else None


def _errors(walked: Found | None, recorded: Found) -> Compared:
    """RMS of the difference over the cycle, body weights."""
    for name, expected in recorded.curves.items():
        force = None if walked is None else walked.curves.get(name)
        yield name, None if force is None else float(np.sqrt(np.mean((force - expected) ** 2)))


def _over_time(motion: OverTime) -> dict[str, Array]:
    return {
        f"achilles_{side}": tendon_force(
            motion.angle(f"ankle_angle_{side}"), motion.moment(f"ankle_angle_{side}")
        )
        for side in "rl"
    }


TENDON_FORCE: Final = Quantity(
    name="tendon_force",
    title="Force in the Achilles tendon",
    axis="force",
    unit="BW",
    note="Force in the Achilles tendon: the ankle’s plantarflexion moment over the tendon’s moment "
    "arm, which is that of ten men (Manal et al. 2013) and not this person’s; in body weights, "
    "positive in tension. The whole moment is taken to be the tendon’s.",
    needs=("angles", "moments"),
    curves={"achilles": "Achilles tendon force"},
    of_curves=_of_curves,
    figures={"peak": "BW"},
    figures_of=_figures,
    tables=(FigureTable("Force in the Achilles tendon", "BW", 2, (("Peak", "peak", "achilles"),)),),
    measures=(QuantityMeasure("tendon_force_rmse", "BW", _errors),),
    of_time=_over_time,
    time_unit="N",
    shown="nothing",
)
