"""Other ways to identify a body than the posterior with independent errors, for a study's run:
`identification.method` names one of them.

Bounds are `WIDE` SDs of the prior, so that none decides what is found, and the verdict is that of
the posterior whatever the bound. The walker takes the posterior mean, which is shrunk towards the
scaled body by as much as the record leaves open; nothing jumps at a threshold.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.datasets.subject import Subject
from gaitval.errors import ConfigurationError
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.body_report import in_words
from gaitval.identification.combinations import correlation, judged_combinations, parameter_sum
from gaitval.identification.offsets import offset_of
from gaitval.identification.shared_errors import STUCK, identified
from gaitval.identification.unidentified import unidentified
from gaitval.identification.verdicts import judged
from gaitval.metrics.identified_body import MOST
from gaitval.metrics.results import FoundParameters
from gaitval.metrics.typed import number
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.storage import Policy
from gaitval.reference.dynamic_fit import Solution

WORDS: Final = "words"
"""What the report of a study says of the body (`bars.in_words`), in `identification.json`."""
WIDE: Final = 2.5
_Progress = Callable[[dict[str, float]], None]
"""Called with the generation, how many there are at most, and the value, as by `identify`."""


def _bounded(mu: Array, prior_sd: Array, configuration: Configuration) -> FoundParameters:
    """A result that walks with `mu`, within the wide bounds, with no posterior yet."""
    empty = unidentified(configuration, prior_sd)
    nominal = nominal_parameters()
    lower, upper = nominal - WIDE * prior_sd, nominal + WIDE * prior_sd
    # Neither is looked for.
    lower[:2], upper[:2] = empty.lower[:2], empty.upper[:2]
    return empty.model_copy(
        update={
            "identified": np.clip(mu, lower, upper).tolist(),
            "lower": lower.tolist(),
            "upper": upper.tolist(),
            "on_bound": [bool(each) for each in (mu < lower) | (mu > upper)],
        }
    )


def shared_identification(
    fit: BodyFit,
    fixed_body: Solution,
    subject: Subject,
    record: GaitRecord,
    model: BodyModel,
    configuration: Configuration,
    on_progress: _Progress,
) -> FoundParameters:
    """`identification.method=shared`: the posterior with errors that angles and belt share. The
    walker has its mean, and legs that differ by the mean of their difference (`legs`).

    `fit` is of `record`, and `fixed_body` its solution with the body (`model`) as scaled. `subject`
    is whose record it is; the prior's mean has the offset of other people. Of the `configuration`
    the bounds of damping and friction are used. `on_progress` is called once, with the sum of
    squares. Raises ConfigurationError if the extended parameters are asked for, which are among its
    errors already.
    """
    if fit.extended:
        raise ConfigurationError(
            "identification.method = shared: sole and legs that differ are among its errors "
            "already. Leave identification.parameters at paper, or set identification.method to "
            "posterior."
        )
    shared = identified(fit, fixed_body, offset_of(subject))
    posterior, (apart, _) = shared.posterior, shared.legs.estimate
    on_progress({"generation": 1, "total": 1, "value": shared.cost})
    return _bounded(posterior.mean, posterior.prior_sd, configuration).model_copy(
        update={
            "posterior_mean": posterior.mean.tolist(),
            "standard_deviation": posterior.sd.tolist(),
            "verdicts": [each.verdict for each in judged(posterior)],
            "correlation": correlation(posterior).tolist(),
            "combinations": [parameter_sum(each) for each in judged_combinations(posterior, model)],
            "plates": posterior.plates.tolist(),
            # of the difference, the left leg is longer by half, and the right one shorter
            WORDS: in_words(shared, model, "shared"),
            "left_leg": float(np.clip(0.5 * apart / model.leg_length, -MOST, MOST)),
            "deviance_nominal": number(fixed_body.cost),
            "deviance_identified": number(shared.cost),
            "converged": shared.left <= STUCK,
        }
    )  # fmt: skip


def rollouts_identification(
    fit: BodyFit,
    record: GaitRecord,
    model: BodyModel,
    policy: Policy,
    configuration: Configuration,
    on_progress: _Progress,
) -> FoundParameters:
    """`identification.method=rollouts`: the paper's own, with a `policy` (that of the round), on
    `record` and the body (`model`) as scaled. It has no posterior, so no parameter is identified by
    it; the walker takes its body all the same.

    Of `fit` only the prior is used. The `configuration` has the
    settings of the search and of walking; `on_progress` is called after each generation, with its
    best epsilon.
    """
    from gaitval.identification.rollouts import BodyWalks, identified_by_rollouts

    most = configuration.identification.generations

    def on_generation(generation: int, best: float) -> None:
        on_progress({"generation": generation, "total": most, "value": best})

    found = identified_by_rollouts(
        BodyWalks(record, model, policy, configuration),
        fit.prior_sd, configuration.identification,
        seed=configuration.seed, on_generation=on_generation,
    )  # fmt: skip
    return _bounded(found.mu, fit.prior_sd, configuration).model_copy(
        update={
            "posterior_mean": found.mu.tolist(),
            "converged": found.searched.converged,
            "history": list(found.searched.history),
        }
    )
