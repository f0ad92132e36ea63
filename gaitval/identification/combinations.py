"""Sums of parameters that matter as one: the length of the leg."""

from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.verdicts import Judged, verdict_of
from gaitval.metrics.results import ParameterSum
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS


@dataclass(frozen=True)
class Combination:
    """A sum of parameters that matters as one: `weights` @ (mu - prior mean), in `unit`."""

    name: str
    unit: str
    weights: Array


def combinations(model: BodyModel) -> tuple[Combination, ...]:
    """Length of the leg (thigh + shank), m, and height of the hip above the ankle for a straight
    leg, m, which the vertical offsets of the joints change too; means of both sides. `model` is the
    body as scaled, whose lengths turn factors of mu into m.
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


def judged_combinations(posterior: BodyPosterior, model: BodyModel) -> tuple[Judged, ...]:
    """The combinations with their verdicts, by a `posterior` of all parameters together and the
    `model` as scaled, see `combinations`.
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


def lengths(model: BodyModel) -> tuple[Combination, ...]:
    """The combinations of a posterior (`combinations`), then the distances from hip to
    knee and from knee to ankle of the body as scaled, m.
    """
    leg, reach = combinations(model)
    thigh, shank = np.zeros(len(PARAMETERS)), np.zeros(len(PARAMETERS))
    for weights, name, below in ((thigh, "thigh_length", "knee_z"),
                                 (shank, "shank_length", "ankle_z")):  # fmt: skip
        for each in (name, below):
            weights[PARAMETERS.index(each)] = reach.weights[PARAMETERS.index(each)]
    return (
        leg,
        reach,
        Combination("hip to knee", "m", thigh),
        Combination("knee to ankle", "m", shank),
    )


def judged_lengths(posterior: BodyPosterior, model: BodyModel) -> tuple[Judged, ...]:
    """The `lengths` of the body `model` with their verdicts."""
    found = []
    for each in lengths(model):
        prior_sd = float(np.linalg.norm(each.weights * posterior.prior_sd))
        sd = float(np.sqrt(each.weights @ posterior.covariance @ each.weights))
        mean = float(each.weights @ (posterior.mean - posterior.prior_mean))
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
