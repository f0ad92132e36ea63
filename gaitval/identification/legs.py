"""Whether legs differ by more than people's do, and by how much.

A fit supposes that legs differ as people's do (`shared_errors`), and so it draws a larger
difference in: of 28 mm it leaves 20. Here that prior is taken out of the estimate again, which
leaves what the record alone says, and two suppositions are weighed against each other: legs as
people's are, and legs that differ by `LEG_ODDS.more` beside. Their ratio of likelihoods is compared
with `LEG_ODDS.odds`, and the difference is what both say of it, each with the weight of its
likelihood.

What a fit supposes is not all that makes legs seem to differ. Beside its own SD stand the `causes`:

* the laboratory: of the ten built-in people, all of one, the left leg is longer by 5.1 mm in the
  mean of what their records alone say, and by 3.3 between the joint centres of their markers; what
  the laboratory adds is the difference, 1.9 ± 1.3 mm (`LEG_ODDS.laboratory`);
* the zero of a knee that differs by side, or a knee that is held flexed: a leg with a bent knee is
  shorter, by half of it times the sine of half of the angle for each radian, and of two knees whose
  largest extensions differ a record does not say by how much the markers do (`held`). As much as
  zeros differ in everybody is among the fit's own unknowns, and is not counted again.

Skin, belts and bodies that err otherwise than any model of them are in the fit's own SD, which
trusts a record by `shared_errors.TRUST`: so intervals of 90 % hold 96 % of the differences of 196
stored harsh people, and 86 % of those beyond 17 mm (91 and 73 % without).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np


@dataclass(frozen=True)
class LegOdds:
    """When legs are said to differ."""

    more: float = 0.020
    """m, SD of what a difference is beside what people's are: 20 mm are seen in one of a thousand
    (Guichet et al. 1991, Clin Orthop 272:235), and are why somebody is measured."""
    odds: float = 0.93
    """Ratio of the likelihoods from which on legs are said to differ by more than people's: beyond
    13.6 mm. Chosen on people of the harsh world of seeds 66889 and 424242: 4 of 78 whose legs
    differ as people's do are called different, of whom 3 have legs that are 13 to 16 mm apart, and
    23 of 24 are found whose legs differ by 20 to 30 mm."""
    laboratory: float = 0.002
    """m, SD of what a laboratory gets wrong on everybody: √(1.9² + 1.3²) mm."""
    zero: float = 0.5
    """Share of the difference of two knees' largest extensions that may be one of their zeros:
    SD."""
    nothing: float = 1e-6
    seen: float = 1.645
    """Standard deviations from zero from which on a difference is seen: of the other sign it is
    with 5 %."""


LEG_ODDS: Final = LegOdds()


@dataclass(frozen=True)
class LegDifference:
    """Left less right leg, hip to ankle, m, as a fit finds it: a longer leg and a lower hip centre
    are seen as one.

    Attributes
    ----------
    found, found_sd : posterior mean and SD of the fit.
    prior_sd : of the fit's prior, whose mean is 0.
    causes : SD of what else makes legs seem to differ, see `causes`.
    """

    found: float
    found_sd: float
    prior_sd: float
    causes: float = 0.0

    @property
    def alone(self) -> tuple[float, float]:
        """(2,) m, what the record alone says: mean without the prior, and SD with all causes."""
        # Of a record that says nothing the SD is as large as one likes, and not infinite.
        kept = max(1.0 - (self.found_sd / self.prior_sd) ** 2, LEG_ODDS.nothing)
        return self.found / kept, float(np.hypot(self.found_sd / np.sqrt(kept), self.causes))

    @property
    def odds(self) -> float:
        """How much likelier the record is if legs differ by more than people's do."""
        mean, sd = self.alone
        usual = sd**2 + self.prior_sd**2
        wide = usual + LEG_ODDS.more**2
        return float(np.sqrt(usual / wide) * np.exp(0.5 * mean**2 * (1.0 / usual - 1.0 / wide)))

    @property
    def differ(self) -> bool:
        """Whether legs differ by more than people's do. Of what a record says nothing, both
        suppositions are as likely: then they do not.
        """
        mean, sd = self.alone
        return self.odds > LEG_ODDS.odds and abs(mean) > LEG_ODDS.seen * sd

    @property
    def estimate(self) -> tuple[float, float]:
        """(2,) m, mean and SD of the difference, both suppositions weighed."""
        mean, sd = self.alone
        more = self.odds / (self.odds + 1.0)
        found = []
        for variance in (self.prior_sd**2, self.prior_sd**2 + LEG_ODDS.more**2):
            kept = variance / (variance + sd**2)
            found.append((kept * mean, kept * sd**2))
        weights = np.array([1.0 - more, more])
        means, variances = np.array(found).T
        middle = float(weights @ means)
        return middle, float(np.sqrt(weights @ (variances + (means - middle) ** 2)))


def held(extension: Mapping[str, float], leg: float, fitted: float) -> float:
    """m, SD of the difference of legs of the length `leg` (m) that zeros of knees which differ by
    side make; `extension` is the least flexion of each knee over a cycle, rad, by "r" and "l".
    `fitted` rad is the SD of the difference of zeros that a fit has among its unknowns.
    """
    zero = np.sqrt(max((LEG_ODDS.zero * (extension["l"] - extension["r"])) ** 2 - fitted**2, 0.0))
    bent = max(*extension.values(), 0.0)
    return float(0.5 * leg * np.sin(0.5 * bent) * zero)


def causes(extension: Mapping[str, float], leg: float, laboratory: bool, *, fitted: float) -> float:
    """m, SD of all that makes legs seem to differ beside what a fit supposes; see `held`. People
    whom gaitval makes are in no `laboratory` that errs on everybody.
    """
    common = LEG_ODDS.laboratory if laboratory else 0.0
    return float(np.hypot(common, held(extension, leg, fitted)))
