"""What a posterior says about each body parameter: identified, weak, not identified.

The verdict follows the contraction, posterior SD / prior SD, as in simulation-based calibration
(Talts et al. 2018; Schad et al. 2021): at most 0.3 is identified, at most 0.7 weak.
"""

from dataclasses import dataclass
from typing import Final

from gaitval.identification.body_fit import BodyPosterior
from gaitval.metrics.results import Determination
from gaitval.model.parameters import PARAMETERS

IDENTIFIED: Final = 0.3
WEAK: Final = 0.7


@dataclass(frozen=True)
class Judged:
    """A parameter, or a combination of them, before and after the record is seen.

    Attributes
    ----------
    name : of the parameter or combination.
    prior_mean, prior_sd : of the prior; a combination's mean is 0.
    mean, sd : of the posterior; a combination's are about its prior mean.
    verdict : from the contraction.
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
    """The verdict on a parameter from its `contraction`, posterior SD / prior SD."""
    if contraction <= IDENTIFIED:
        return "identified"
    return "weak" if contraction <= WEAK else "not identified"


def judged(posterior: BodyPosterior) -> tuple[Judged, ...]:
    """Every parameter of the `posterior`, of all together, with its verdict, in the order of
    `PARAMETERS`.
    """
    found = []
    for i, name in enumerate(PARAMETERS):
        mean, sd = float(posterior.mean[i]), float(posterior.sd[i])
        verdict = verdict_of(sd / float(posterior.prior_sd[i]))
        prior = float(posterior.prior_mean[i]), float(posterior.prior_sd[i])
        found.append(Judged(name, *prior, mean, sd, verdict))
    return tuple(found)
