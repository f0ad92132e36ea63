"""What a walk costs a person, by models of the muscles and of the joints, side by side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval._internal.text.display import Displayed
from gaitval.coordinates import SIDES
from gaitval.kinetics.musculature.gait import LoadedMotion, MuscleGait
from gaitval.kinetics.musculature.metabolics import METABOLISM, MODELS
from gaitval.quantities.metabolic_rate import (
    CENTRAL,
    METABOLIC_JOINTS,
    TITLES,
    expected_rate,
    muscle_rates,
)
from gaitval.quantities.quantity import OverTime

if TYPE_CHECKING:
    import pandas as pd

JOINTS: Final = "joints"
SPREAD: Final[Mapping[str, float]] = {"people": 0.13, "model": 0.083}
"""Standard deviations as shares of the rate. Of people's rates about what is expected of their
speed: 35 adults on the level at 0.75 to 1.75 m/s (`experiments/level_rates.py` of commit 60ee3cba).
Of what the joints' model is off for a group: ten conditions of forty people, to which its two
numbers were fitted (`experiments/joint_metabolics.py`; 0.115 for those left out, the fastest among
them)."""
_NORMAL_90: Final = 1.645

LEFT_OUT: Final = (
    "the muscles of trunk and arms",
    "co-contraction beyond what the moments need",
    "what breathing and the heart take above rest",
)


@dataclass(frozen=True, repr=False)
class MetabolicCost(Displayed):
    """Metabolic rate of a walk.

    Attributes
    ----------
    name : whose.
    mass_kg : of the body.
    speed : m/s; None where it is not known.
    gross : W/kg, with rest, by model: `MODELS` of muscles, and "joints".
    """

    name: str
    mass_kg: float
    speed: float | None
    gross: Mapping[str, float]

    @property
    def muscles(self) -> float | None:
        """W/kg, gross, by the model that stands for those of muscles."""
        return self.gross.get(CENTRAL)

    @property
    def joints(self) -> float | None:
        """W/kg, gross, by the model of the joints."""
        return self.gross.get(JOINTS)

    @property
    def middle(self) -> float:
        """W/kg, gross, mean of both; of one where the other is not known."""
        known = [each for each in (self.muscles, self.joints) if each is not None]
        return float(np.mean(known))

    def band(self) -> tuple[float, float]:
        """W/kg, gross, low and high of 90 % of a person who walks like this: around the middle, by
        what a model is off for people, and what people differ.
        """
        reach = _NORMAL_90 * float(np.hypot(SPREAD["people"], SPREAD["model"]))
        return (1.0 - reach) * self.middle, (1.0 + reach) * self.middle

    def net(self, model: str) -> float:
        """W/kg above rest, by a `model`."""
        return self.gross[model] - METABOLISM.rest

    def per_metre(self, model: str) -> float | None:
        """J/kg/m, gross, by a `model`."""
        return None if not self.speed else self.gross[model] / self.speed

    def expected(self) -> float | None:
        """W/kg, gross, that is expected of level walking at the speed."""
        return None if self.speed is None else expected_rate(self.speed)

    def title(self) -> str:
        """Whose, how fast, and the rate."""
        low, high = self.band()
        at = "" if self.speed is None else f" at {self.speed:.2f} m/s"
        return (
            f"Metabolic rate of {self.name}{at}: {self.middle:.1f} W/kg "
            f"(90 %: {low:.1f} to {high:.1f})"
        )

    def overview(self) -> "pd.DataFrame":
        """The table by model."""
        return self.to_frame()

    def to_frame(self) -> "pd.DataFrame":
        """A row a model: gross and net W/kg, J/kg/m."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "model": TITLES.get(model, model),
                    "gross_w_kg": rate,
                    "net_w_kg": self.net(model),
                    "gross_j_kg_m": self.per_metre(model),
                }
                for model, rate in self.gross.items()
            ]
        )


def metabolic_cost(motions: Sequence[LoadedMotion], muscles: MuscleGait) -> MetabolicCost | None:
    """What the walk of `motions` costs, whose `muscles` are known; None where no side has a whole
    gait cycle, or a prosthesis has a part of either leg.

    The other leg is taken to be alike where one has no cycle.
    """
    if any(not leg.present.all() for leg in muscles.legs.values()):
        return None
    found = muscle_rates(muscles)
    if found is None:
        return None
    sides = [side[0] for side in SIDES if side in muscles.legs]
    gross = {
        model: _mean([found.figures["gross"][f"{model}_{side}"] for side in sides])
        for model in MODELS
    }
    by_joints = [each for each in map(joint_rate, motions) if each is not None]
    if by_joints:
        gross[JOINTS] = _mean(by_joints)
    speeds = [each.speed for each in motions if each.speed is not None]
    return MetabolicCost(muscles.name, muscles.mass_kg, _mean(speeds) if speeds else None, gross)


def joint_rate(motion: LoadedMotion) -> float | None:
    """W/kg of the body, gross, by the model of the joints, over the cycles of a `motion`; None
    without one.
    """
    dynamics = motion.dynamics
    moments, powers = dynamics.moments, dynamics.powers
    if motion.assist is not None:
        joints = motion.positions[:, -moments.shape[1] :]
        moments = moments - motion.assist
        powers = moments * np.gradient(joints, dynamics.time, axis=0)
    of_time = METABOLIC_JOINTS.of_time
    assert of_time is not None
    legs = of_time(OverTime(motion.positions[:, -moments.shape[1] :], moments, powers))
    found = []
    for side, cycles in motion.cycles.items():
        for start, end in cycles:
            inside = (dynamics.time >= start) & (dynamics.time < end)
            if inside.any():
                found.append(float(legs[f"leg_{side[0]}"][inside].mean()))
    return METABOLISM.rest + 2.0 * float(np.mean(found)) / motion.model.mass if found else None


def _mean(values: Sequence[float | None]) -> float:
    return float(np.mean([each for each in values if each is not None]))


__all__ = ["JOINTS", "LEFT_OUT", "MetabolicCost", "joint_rate", "metabolic_cost"]
