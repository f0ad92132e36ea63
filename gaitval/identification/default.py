"""The default identification of a study, `identification.method=shared`: the posterior with errors
that angles and belt share. Others are in `rollouts` (the paper's) and `unidentified` (none).

Bounds are `unidentified.WIDE` SDs of the prior, so that none decides what is found, and the verdict
is that of the posterior whatever the bound. The walker takes the posterior mean, which is shrunk
towards the scaled body by as much as the record leaves open, where the record `fits` the model. So
found, legs of harsh and of harsher people than the fit expects are nearer to the truth than as
scaled on average, however they were measured (`experiments/harsher_people.py` of
commit 60ee3cba). Its legs are equal unless `two_legs` says otherwise.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from gaitval.configuration import Configuration
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.body_report import in_words
from gaitval.identification.combinations import correlation, judged_combinations, parameter_sum
from gaitval.identification.offsets import offset_of
from gaitval.identification.shared_errors import SHARED, identified
from gaitval.identification.unidentified import bounded
from gaitval.identification.verdicts import judged
from gaitval.metrics.identified_body import MOST
from gaitval.metrics.results import FoundParameters
from gaitval.metrics.typed import number
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.dynamic_fit import Solution

WORDS: Final = "words"
"""What the report of a study says of the body (`bars.in_words`), in `identification.json`."""
_Progress = Callable[[dict[str, float]], None]
"""Called with the generation, how many there are at most, and the value, as by `identify`."""


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
    walker has its mean where the record `fits`, and, with `identification.two_legs`, legs that
    differ by the mean of their difference (`legs`).

    `fit` is of `record`, and `fixed_body` its solution with the body (`model`) as scaled. `subject`
    is whose record it is; the prior's mean has the offset of other people. Of the `configuration`
    the bounds of damping and friction are used. `on_progress` is called once, with the sum of
    squares.
    """
    shared = identified(fit, fixed_body, offset_of(subject))
    posterior, (apart, _) = shared.posterior, shared.legs.estimate
    on_progress({"generation": 1, "total": 1, "value": shared.cost})
    found = posterior.mean if shared.fits else nominal_parameters()
    two_legs = configuration.identification.two_legs and shared.fits
    return bounded(found, posterior.prior_sd, configuration).model_copy(
        update={
            "posterior_mean": posterior.mean.tolist(),
            "standard_deviation": posterior.sd.tolist(),
            "verdicts": [each.verdict for each in judged(posterior)],
            "correlation": correlation(posterior).tolist(),
            "combinations": [parameter_sum(each) for each in judged_combinations(posterior, model)],
            "plates": posterior.plates.tolist(),
            # of the difference, the left leg is longer by half, and the right one shorter
            WORDS: in_words(shared, model, "shared"),
            "left_leg": float(np.clip(0.5 * apart / model.leg_length, -MOST, MOST))
            if two_legs
            else 0.0,
            "deviance_nominal": number(fixed_body.cost),
            "deviance_identified": number(shared.cost),
            "converged": shared.left <= SHARED.stuck,
        }
    )  # fmt: skip
