"""What a posterior says about each body parameter: identified, weak, not identified, at its bound.

The verdict follows the contraction, posterior SD / prior SD, as in simulation-based calibration
(Talts et al. 2018; Schad et al. 2021): at most 0.3 is identified, at most 0.7 weak. What is not
identified stays at its prior mean.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from gaitval.arrays import Array
from gaitval.identification.body_fit import BodyPosterior
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import PARAMETERS

Verdict = Literal["identified", "weak", "not identified", "at its bound"]

IDENTIFIED: Final = 0.3
WEAK: Final = 0.7


@dataclass(frozen=True)
class Combination:
    """A sum of parameters that matters as one: `weights` @ (mu - prior mean), in `unit`."""

    name: str
    unit: str
    weights: Array


def combinations(model: BodyModel) -> tuple[Combination, ...]:
    """Length of the leg (thigh + shank), m, and how far the hip is above the ankle for a straight
    leg, m, which the vertical offsets of the joints change too.
    """
    leg = np.zeros(len(PARAMETERS))
    for name, segment in (("thigh_length", "shank_r"), ("shank_length", "foot_r")):
        joint = model.segments[SEGMENTS.index(segment)].joint_position
        leg[PARAMETERS.index(name)] = -joint[2]
    reach = leg.copy()
    for name in ("knee_z", "ankle_z"):
        reach[PARAMETERS.index(name)] = -1.0
    return (
        Combination("leg length, thigh + shank", "m", leg),
        Combination("hip to ankle, straight leg", "m", reach),
    )


@dataclass(frozen=True)
class Judged:
    """A parameter, or a combination of them, before and after.

    Attributes
    ----------
    mean, sd : of the posterior; a combination's are about its prior mean.
    z : posterior mean less prior mean, in prior SDs.
    """

    name: str
    prior_mean: float
    prior_sd: float
    mean: float
    sd: float
    verdict: Verdict

    @property
    def contraction(self) -> float:
        """Posterior SD / prior SD."""
        return self.sd / self.prior_sd

    @property
    def z(self) -> float:
        """Posterior mean less prior mean, in prior SDs."""
        return (self.mean - self.prior_mean) / self.prior_sd


def verdict_of(contraction: float) -> Verdict:
    """The verdict on a parameter inside its bounds."""
    if contraction <= IDENTIFIED:
        return "identified"
    return "weak" if contraction <= WEAK else "not identified"


def judged(
    posterior: BodyPosterior, bounds: tuple[Array, Array] | None = None
) -> tuple[Judged, ...]:
    """Every parameter with its verdict.

    Parameters
    ----------
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
    """The combinations with their verdicts."""
    found = []
    for each in combinations(model):
        weights = each.weights
        prior_sd = float(np.sqrt(np.sum((weights * posterior.prior_sd) ** 2)))
        sd = float(np.sqrt(weights @ posterior.covariance @ weights))
        mean = float(weights @ (posterior.mean - posterior.prior_mean))
        found.append(Judged(each.name, 0.0, prior_sd, mean, sd, verdict_of(sd / prior_sd)))
    return tuple(found)


def correlation(posterior: BodyPosterior) -> Array:
    """(14, 14) of the posterior."""
    return np.asarray(posterior.covariance / np.outer(posterior.sd, posterior.sd))
