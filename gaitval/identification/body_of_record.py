"""What the records of a person say about its body, if skin moves with the joints and the belt errs.

No policy has a part in it; errors of the record are estimated with the body (`shared_errors`).
"""

from gaitval._internal.numba.one_thread import one_thread
from gaitval.configuration import Configuration
from gaitval.datasets.subject import Subject
from gaitval.errors import SubjectError
from gaitval.identification.begin import begin
from gaitval.identification.offsets import offset_of
from gaitval.identification.pooled import pooled
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import Shared, identified
from gaitval.model.body import BodyModel
from gaitval.reference.dynamic_fit import consistent_reference


def body_of_record(
    person: Subject, model: BodyModel, configuration: Configuration, *, further_trials: bool = False
) -> Shared:
    """The body of a `person` by its record, and by all of its `further_trials` if asked for.

    `model` is as scaled; of `configuration` count `identification`, `contact` and `noise`. Raises
    SubjectError if there are no further trials.
    """
    if further_trials and not person.trials:
        raise SubjectError(
            f"{person.identifier} has one trial, so there are none to take with it. Leave --trials "
            "out, or add the others to its file, each under [[trials]]."
        )
    others = [person.on_trial(each.name) for each in person.trials] if further_trials else []
    each_trial = []
    for own in (person, *others):
        record = own.record()
        with one_thread():
            near = consistent_reference(record, model, configuration.contact)
            fit, fixed = begin(
                record, model, prior_sd(person), configuration, own.has_kinetics, near
            )
            each_trial.append(identified(fit, fixed, offset_of(person)))
    return pooled(each_trial) if others else each_trial[0]
