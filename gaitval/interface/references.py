"""The reference motion that a walker imitates, from Python."""

from collections.abc import Sequence

from gaitval._internal.numba.one_thread import one_thread
from gaitval.configuration import load_configuration
from gaitval.interface.arguments import expect
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.dynamic_fit import consistent_reference
from gaitval.walk.reference.motion import ReferenceMotion


def reference_motion(subject: Subject, *, settings: Sequence[str] = ()) -> ReferenceMotion:
    """The periodic motion that the walker of a subject imitates, as the stage `reference` builds
    it.

    It is the recorded gait on the scaled body, changed within the accuracy of the record so that
    it obeys the laws of motion. It takes some seconds.

    Parameters
    ----------
    subject : whose record it is.
    settings : "section.key=value", as for `--set`; here those of `contact`.

    Returns
    -------
    ReferenceMotion
        N samples of the right gait cycle: `positions` and `velocities` (N, 31) in rad, m and s,
        `moments` (N, 25) Nm, `ground_reaction` (N, 2, 3) body weights; x forward, y left, z up.

    Raises
    ------
    ScalingError
        The subject's lengths give no plausible body.
    ConfigurationError
        There is no such setting.

    References
    ----------
    Winter (2009), Biomechanics and Motor Control of Human Movement, chapter 5: the equations of
    motion; `gaitval.walk.reference` says what is derived and what is a convention.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> reference = gv.reference_motion(subject)
    >>> reference.positions.shape, reference.stride_time == subject.stride_time_s
    ((1024, 31), True)
    """
    expect("subject", subject, Subject, "what load_subject(5) returns")
    configuration = load_configuration(settings=settings)
    model = scale_subject(subject, symmetric=configuration.scaling.symmetric).model
    with one_thread():
        return consistent_reference(subject.record(), model, configuration.contact)
