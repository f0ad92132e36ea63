"""What the scripts of bodies share: a person's fit, and a virtual person's walk."""

from typing import Any

from gaitval.configuration import Configuration, load_configuration
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.prior import prior_sd
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon
from gaitval.model.body import BodyModel
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.reference.dynamic_fit import Solution, consistent_reference
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask


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


def person_of(number: int) -> Subject:
    """Whom a virtual person is drawn around."""
    person = load_subject(1 + number // 2 % 10)
    if number // 2 % 2:
        return person.model_copy(update={"markers": {}})
    return person


def walked(
    subject: Subject, model: BodyModel, mu: Any, policy: Policy, configuration: Configuration
) -> float | None:
    """Epsilon of the general policy's walk with mu against the subject's record."""
    record = subject.record()
    task = WalkingTask.of(model, record, configuration, mu=mu)
    validation = configuration.validation
    rollout = record_rollout(
        WalkingEnvironment(task), policy, mu=mu, start_phase=0.0,
        cycles=validation.settling_cycles + 14,
    )  # fmt: skip
    curves = curves_of(task, rollout, find_cycles(rollout, configuration).first(12))
    found = epsilon(curves, recorded_curves(record))
    return None if found is None else found.total
