"""The body parameters mu if the record is not asked for them: the body stays as scaled. A method
enters what it finds from here on.
"""

from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.metrics.results import FoundParameters
from gaitval.model.parameters import PARAMETERS, nominal_parameters, parameter_bounds

WIDE: Final = 2.5
"""SDs of the prior to the bounds of what is found: so far that none decides it."""


def unidentified(configuration: Configuration, prior_sd: Array) -> FoundParameters:
    """The result if nothing is looked for: the body stays as scaled. The bounds of the parameters
    in `configuration` are entered, and `prior_sd` (14,) of mu also as the posterior's.
    """
    mu = nominal_parameters()
    lower, upper = parameter_bounds(configuration.randomisation)
    numbers, sd = mu.tolist(), prior_sd.tolist()
    return FoundParameters(
        names=list(PARAMETERS),
        nominal=numbers,
        identified=numbers,
        prior_standard_deviation=sd,
        posterior_mean=numbers,
        standard_deviation=sd,
        lower=lower.tolist(),
        upper=upper.tolist(),
        on_bound=[False] * len(mu),
        verdicts=["not identified"] * len(mu),
        profiles=[],
        correlation=np.eye(len(mu)).tolist(),
        combinations=[],
        extended=[],
        plates=[0.0, 0.0],
        deviance_nominal=None,
        deviance_identified=None,
        converged=False,
        search_distance=None,
        history=[],
    )


def bounded(mu: Array, prior_sd: Array, configuration: Configuration) -> FoundParameters:
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
