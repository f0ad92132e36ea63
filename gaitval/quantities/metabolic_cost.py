"""What a walk costs a person, by models of the muscles and of the joints, side by side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.display import Displayed
from gaitval.musculature.gait import LoadedMotion, MuscleGait
from gaitval.musculature.metabolics import MODELS, REST
from gaitval.quantities.metabolic_rate import (
    CENTRAL,
    METABOLIC_JOINTS,
    TITLES,
    expected_rates,
    muscle_rates,
)
from gaitval.quantities.quantity import OverTime

if TYPE_CHECKING:
    import pandas as pd

JOINTS: Final = "joints"
PERSON: Final = 0.20
"""W/kg, by which a person's rate differs from what is expected of people at that speed: the
standard error of estimate of Looney et al. (2019), Med Sci Sports Exerc 51:1954, abstract."""
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
    draws : (D,) W/kg, gross, by model of muscles; empty if none were asked for.
    """

    name: str
    mass_kg: float
    speed: float | None
    gross: Mapping[str, float]
    draws: Mapping[str, Array] = field(default_factory=dict)

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
        """W/kg, gross: from the lowest to the highest model, each as uncertain as a person's rate
        at a speed is, and where there are draws, the central 90 % of those of all models.
        """
        low, high = min(self.gross.values()), max(self.gross.values())
        if self.draws:
            pooled = np.concatenate(list(self.draws.values()))
            edges = np.quantile(pooled, [0.05, 0.95])
            low, high = min(low, float(edges[0])), max(high, float(edges[1]))
        return low - _NORMAL_90 * PERSON, high + _NORMAL_90 * PERSON

    def net(self, model: str) -> float:
        """W/kg above rest, by a `model`."""
        return self.gross[model] - REST

    def per_metre(self, model: str) -> float | None:
        """J/kg/m, gross, by a `model`."""
        return None if not self.speed else self.gross[model] / self.speed

    def expected(self) -> Mapping[str, float]:
        """W/kg, gross, that published equations expect of level walking at the speed."""
        return {} if self.speed is None else expected_rates(self.speed)

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
    draws = {
        model: REST
        + 2.0 * np.mean([leg.metabolic_draws[model] for leg in muscles.legs.values()], axis=0)
        for model in MODELS
        if all(model in leg.metabolic_draws for leg in muscles.legs.values())
    }
    speeds = [each.speed for each in motions if each.speed is not None]
    return MetabolicCost(
        muscles.name, muscles.mass_kg, _mean(speeds) if speeds else None, gross, draws
    )


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
    return REST + 2.0 * float(np.mean(found)) / motion.model.mass if found else None


def _mean(values: Sequence[float | None]) -> float:
    return float(np.mean([each for each in values if each is not None]))


__all__ = ["JOINTS", "LEFT_OUT", "MetabolicCost", "joint_rate", "metabolic_cost"]
