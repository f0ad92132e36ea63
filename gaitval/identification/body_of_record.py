"""What the record of a person says about its body, if skin moves with the joints and the belt errs.

No policy has a part in it; errors of the record are estimated with the body (`shared_errors`).
"""

from gaitval._internal.numba.one_thread import one_thread
from gaitval.configuration import Configuration
from gaitval.identification.begin import begin
from gaitval.identification.offsets import offset_of
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import Shared, identified
from gaitval.model.body import BodyModel
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.dynamic_fit import consistent_reference


def body_of_record(person: Subject, model: BodyModel, configuration: Configuration) -> Shared:
    """The body of a `person` by its record. `model` is as scaled; of `configuration` count
    `identification`, `contact` and `noise`.
    """
    record = person.record()
    with one_thread():
        near = consistent_reference(record, model, configuration.contact)
        fit, fixed = begin(
            record, model, prior_sd(person), configuration, person.has_kinetics, near
        )
        return identified(fit, fixed, offset_of(person))
