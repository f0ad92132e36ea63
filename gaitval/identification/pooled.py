"""Several trials of one person together, whose errors are nearly the same.

Trials of one session share markers, skin, plates and belt, and the model that is fitted. What they
say of a body differs by far less than their SDs: of the variance of an error, `SAME` is common to
the trials of a person. A mean with weights w of numbers whose errors correlate by SAME has
SAME + (1 - SAME) Σ w² of the variance of one, so two trials say 1.05 times as much as one, not
twice. With the prior as unit, a posterior of mean s and covariance C says C⁻¹ s with the
information C⁻¹ - 1. Of both the weighted mean over the trials is taken, over that share, and the
prior counts once. The weights are those with which the body is known best, so a trial that says
little takes nothing from one that says more.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import minimize

from gaitval.arrays import Array
from gaitval.identification.shared_errors import SHARED, SOLE_ENDS, Shared
from gaitval.model.parameters import PARAMETERS

SAME: Final = 0.90
"""Correlation of the errors of two trials of one person: what trials of three people (five pairs,
three speeds) say of a parameter differs by 0.31 of what independent errors would give, and
1 - 0.31² = 0.90 (`experiments.ten_bodies`)."""

_NO_WEIGHT: Final = 1e-6


def together(shifts: Sequence[Array], joints: Sequence[Array]) -> tuple[Array, Array]:
    """Posterior mean (K,) and covariance (K, K) of what several trials say, in prior SDs from the
    prior mean; `shifts` and `joints` are each trial's.
    """
    information, one = np.stack([np.linalg.inv(each) for each in joints]), np.eye(len(shifts[0]))
    scores = np.einsum("tkl,tl->tk", information, np.stack(shifts))

    def known(weights: Array) -> tuple[Array, Array]:
        weights = weights / weights.sum()
        weights = weights / (SAME + (1.0 - SAME) * weights @ weights)
        return one + np.tensordot(weights, information - one, axes=1), weights

    def open_(weights: Array) -> float:
        return -float(np.linalg.slogdet(known(weights)[0])[1])

    # From all alike and from each alone, so that no trial alone is better than what is found.
    starts = np.vstack([np.ones(len(information)), np.eye(len(information)) + _NO_WEIGHT])
    limits = len(information) * [(_NO_WEIGHT, 1.0 + _NO_WEIGHT)]
    ends = [minimize(open_, start, bounds=limits).x for start in starts]
    whole, weights = known(min(ends, key=open_))
    joint = np.linalg.inv(whole)
    return joint @ (weights @ scores), (joint + joint.T) / 2


def pooled(found: Sequence[Shared]) -> Shared:
    """What the trials of one person say together of mu, the sole's ends and legs that differ. The
    rest, the errors of a record among it, is the first trial's. Each trial in `found` is of a body
    scaled alike and with one offset.
    """
    first, mu = found[0], slice(None, len(PARAMETERS))
    shift, joint = together([each.shift for each in found], [each.joint for each in found])
    sizes = first.posterior.prior_sd
    posterior = replace(
        first.posterior,
        mean=first.posterior.prior_mean + sizes * shift[mu],
        covariance=joint[mu, mu] * np.outer(sizes, sizes),
    )
    ends = slice(-len(SOLE_ENDS), None)
    values, sd = first.values.copy(), first.sd.copy()
    values[ends] += SHARED.sole * (shift[ends] - first.shift[ends])
    sd[ends] = SHARED.sole * np.sqrt(np.diag(joint)[ends])
    unit = first.legs.prior_sd
    (apart,), ((variance,),) = together(
        [np.array([each.legs.found / unit]) for each in found],
        [np.array([[(each.legs.found_sd / unit) ** 2]]) for each in found],
    )
    legs = replace(first.legs, found=unit * float(apart), found_sd=unit * float(np.sqrt(variance)))
    return replace(
        first, posterior=posterior, values=values, sd=sd, shift=shift, joint=joint, legs=legs
    )
