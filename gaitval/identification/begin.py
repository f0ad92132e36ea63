"""What every identification of a body begins with: the fit of a record to the body as scaled."""

from gaitval.arrays import Array
from gaitval.configuration import Configuration, NoiseSettings
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.model.body import BodyModel
from gaitval.walk.reference.dynamic_fit import Solution
from gaitval.walk.reference.motion import ReferenceMotion

FirstFit = tuple[BodyFit, Solution]
"""The fit to a record, and its solution with the body as scaled."""


def noise_of(configuration: Configuration, kinetics_known: bool) -> NoiseSettings:
    """The noise model of `configuration` for a record, whose kinetics are the person's own if
    `kinetics_known`, else what is expected of anybody.
    """
    if kinetics_known:
        return configuration.noise
    from gaitval.subjects.prediction.population import noise_of_expected

    return noise_of_expected(configuration.noise)


def begin(
    record: GaitRecord,
    model: BodyModel,
    prior_sd: Array,
    configuration: Configuration,
    kinetics_known: bool,
    near: ReferenceMotion | None = None,
) -> FirstFit:
    """The fit to a `record` with moments and forces, solved in full with the body as scaled
    (`model`), whose mu has `prior_sd` (14,), see `prior.prior_sd`.

    `configuration` has the settings of noise and contact; `kinetics_known` is
    whether the record's moments and forces are the person's own; `near`: see `BodyFit.as_scaled`.
    """
    fit = BodyFit(
        record, model, configuration.contact, noise_of(configuration, kinetics_known),
        prior_sd=prior_sd,
    )  # fmt: skip
    return fit, fit.as_scaled(near)
