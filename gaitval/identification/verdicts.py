"""What a posterior says about each body parameter: identified, weak, not identified, at its bound.

The verdict follows the contraction, posterior SD / prior SD, as in simulation-based calibration
(Talts et al. 2018; Schad et al. 2021): at most 0.3 is identified, at most 0.7 weak. What is not
identified stays at its prior mean.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.identification.body_fit import BodyPosterior
from gaitval.metrics.results import Determination, ParameterSum
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS

IDENTIFIED: Final = 0.3
WEAK: Final = 0.7


@dataclass(frozen=True)
class Combination:
    """A sum of parameters that matters as one: `weights` @ (mu - prior mean), in `unit`."""

    name: str
    unit: str
    weights: Array


def combinations(model: BodyModel) -> tuple[Combination, ...]:
    """Length of the leg (thigh + shank), m, and height of the hip above the ankle for a straight
    leg, m, which the vertical offsets of the joints change too; means of both sides.

    Parameters
    ----------
    model : the body as scaled, whose lengths turn factors of mu into m.
    """
    leg = np.zeros(len(PARAMETERS))
    for name, segment in (("thigh_length", "shank"), ("shank_length", "foot")):
        right, left = (model[f"{segment}_{side}"].joint_position for side in "rl")
        # A joint lies below its parent's origin, so its z is minus the length; mu is a factor on
        # it.
        leg[PARAMETERS.index(name)] = -(right[2] + left[2]) / 2
    reach = leg.copy()
    for name in ("knee_z", "ankle_z"):
        # A joint that is moved up by 1 m is 1 m closer to the hip.
        reach[PARAMETERS.index(name)] = -1.0
    return (
        Combination("leg length, thigh + shank", "m", leg),
        Combination("hip to ankle, straight leg", "m", reach),
    )


@dataclass(frozen=True)
class Judged:
    """A parameter, or a combination of them, before and after the record is seen.

    Attributes
    ----------
    name : of the parameter or combination.
    prior_mean, prior_sd : of the prior; a combination's mean is 0.
    mean, sd : of the posterior; a combination's are about its prior mean.
    verdict : from the contraction, or `at its bound`.
    """

    name: str
    prior_mean: float
    prior_sd: float
    mean: float
    sd: float
    verdict: Determination

    @property
    def contraction(self) -> float:
        """Posterior SD / prior SD."""
        return self.sd / self.prior_sd

    @property
    def z(self) -> float:
        """Posterior mean less prior mean, in prior SDs."""
        return (self.mean - self.prior_mean) / self.prior_sd


def verdict_of(contraction: float) -> Determination:
    """The verdict on a parameter inside its bounds, from its `contraction`, posterior SD / prior
    SD.
    """
    if contraction <= IDENTIFIED:
        return "identified"
    return "weak" if contraction <= WEAK else "not identified"


def judged(
    posterior: BodyPosterior, bounds: tuple[Array, Array] | None = None
) -> tuple[Judged, ...]:
    """Every parameter with its verdict, in the order of `PARAMETERS`.

    Parameters
    ----------
    posterior : of all parameters together.
    bounds : lowest and highest mu, (14,) each; a mode at or beyond one is at its bound.
    """
    found = []
    for i, name in enumerate(PARAMETERS):
        mean, sd = float(posterior.mean[i]), float(posterior.sd[i])
        verdict = verdict_of(sd / float(posterior.prior_sd[i]))
        if bounds is not None and not bounds[0][i] < mean < bounds[1][i]:
            verdict = "at its bound"
        prior = float(posterior.prior_mean[i]), float(posterior.prior_sd[i])
        found.append(Judged(name, *prior, mean, sd, verdict))
    return tuple(found)


def judged_combinations(posterior: BodyPosterior, model: BodyModel) -> tuple[Judged, ...]:
    """The combinations with their verdicts.

    Parameters
    ----------
    posterior : of all parameters together.
    model : the body as scaled, see `combinations`.
    """
    found = []
    for each in combinations(model):
        weights = each.weights
        # Prior parameters are independent; the posterior's are not, so its variance is wᵀ C w.
        prior_sd = float(np.sqrt(np.sum((weights * posterior.prior_sd) ** 2)))
        sd = float(np.sqrt(weights @ posterior.covariance @ weights))
        mean = float(weights @ (posterior.mean - posterior.prior_mean))
        found.append(Judged(each.name, 0.0, prior_sd, mean, sd, verdict_of(sd / prior_sd)))
    return tuple(found)


def correlation(posterior: BodyPosterior) -> Array:
    """Correlation (14, 14) of the parameters in the `posterior`."""
    return np.asarray(posterior.covariance / np.outer(posterior.sd, posterior.sd))


def parameter_sum(judged: Judged) -> ParameterSum:
    """A `judged` combination, as `identification.json` has it."""
    return ParameterSum(
        name=judged.name,
        prior_standard_deviation=judged.prior_sd,
        mean=judged.mean,
        standard_deviation=judged.sd,
        verdict=judged.verdict,
    )
