"""What the scripts of bodies share: a person's fit."""

from gaitval.configuration import load_configuration
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.prior import prior_sd
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.dynamic_fit import Solution, consistent_reference


def fit_of(subject: Subject) -> BodyFit:
    """The fit of a subject's own trial."""
    configuration = load_configuration()
    return BodyFit(
        subject.record(), scale_subject(subject).model, configuration.contact,
        configuration.noise, prior_sd=prior_sd(subject),
    )  # fmt: skip


def as_scaled(fit: BodyFit, subject: Subject) -> Solution:
    """What the identification of a study begins with: the `fit` of a subject's own trial, solved
    with the body as scaled, from its reference.
    """
    model, contact = scale_subject(subject).model, load_configuration().contact
    return fit.as_scaled(consistent_reference(subject.record(), model, contact))
