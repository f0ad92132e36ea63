"""A result of `gaitval body` that is made up."""

import numpy as np

from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.legs import LegDifference
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import NAMES, Shared
from gaitval.model.parameters import nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.dynamic_fit import Solution

SUBJECT = load_subject("S05")
MODEL = scale_subject(SUBJECT).model


def made_up(contraction: float, difference: float) -> Shared:
    """A result whose lengths are this much narrower than the prior, 1 % longer."""
    sd, mean = prior_sd(SUBJECT), nominal_parameters()
    mean[3:5] *= 1.01
    none = np.zeros(0)
    posterior = BodyPosterior(
        mean=mean, covariance=np.diag((contraction * sd) ** 2), prior_mean=nominal_parameters(),
        prior_sd=sd, plates=np.zeros(2),
    )  # fmt: skip
    zeros = np.zeros(len(NAMES))
    solution = Solution(np.zeros((31, 49)), none, np.zeros((0, 0)), 0.0)
    legs = LegDifference(difference, 0.0036, 0.0086)
    return Shared(posterior, zeros, zeros, solution, 0.0, none, none, legs, 1, 0.0)
