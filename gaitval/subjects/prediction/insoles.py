"""An estimate with the vertical forces that insoles measured.

Both are uncertain: the estimate by its band, the insoles by the error that is stated for them, and
by when feet land by markers, as the estimate's time begins there. The vertical force is the mean of
both, each weighted by one over its variance at each percent of the cycle, and has the band of such
a mean. The other curves stay what they are estimated per vertical force where that makes other
people's nearer (`gaitval.subjects.prediction.worth`), and their bands narrow by as much as it does
in these.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.stats import norm

from gaitval.arrays import Array
from gaitval.gait.insoles import InsoleForces
from gaitval.subjects.prediction.estimate import ESTIMATE, Estimate
from gaitval.subjects.prediction.force_split import LANDING_SPREAD
from gaitval.subjects.prediction.worth import per_vertical

_DEVIATIONS: Final = float(norm.ppf(0.5 + 0.5 * ESTIMATE.band))
"""Half of a band of `ESTIMATE.band` in standard deviations."""


def with_insoles(found: Estimate, insoles: InsoleForces) -> Estimate:
    """The estimate that was `found`, with what `insoles` say of it."""
    own = (found.half_width[-1] / _DEVIATIONS) ** 2
    theirs = insoles.error**2 + np.mean(np.square(_by_landings(insoles)), axis=0)
    share = own / (own + theirs)
    changed = share * (insoles.vertical - found.kinetics[:, -1])
    noise = float(np.sqrt(own.mean()))
    left = found.insoles_leave
    slopes = per_vertical(found.kinetics, noise) * (left < 1.0)[:, None]
    kinetics = found.kinetics + slopes * changed[:, None]
    kinetics[:, -1] = found.kinetics[:, -1] + changed
    # of the squared error that exact insoles would take away, those that are not take this share
    gone = float(1.0 - np.mean(own * (1.0 - share)) / np.mean(own))
    narrower = np.sqrt(1.0 - gone * (1.0 - left**2))[:, None] * np.ones_like(found.half_width)
    narrower[-1] = np.sqrt(1.0 - share)
    return replace(found, kinetics=kinetics, half_width=narrower * found.half_width)


def _by_landings(insoles: InsoleForces) -> Array:
    """(2, n) body weights by which forces are off where a foot lands `LANDING_SPREAD` earlier."""
    vertical = insoles.vertical
    slope = 0.5 * (np.roll(vertical, -1, axis=1) - np.roll(vertical, 1, axis=1))
    return np.asarray(slope * vertical.shape[1] / insoles.stride_time * LANDING_SPREAD)
