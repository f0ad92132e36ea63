"""The body model from Python."""

from gaitval.errors import RecordError
from gaitval.interface.arguments import expect
from gaitval.kinetics.inverse.scaled_markers import MarkedBody
from gaitval.scaling.marker_sets import recognise
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject


def scale(subject: Subject, *, symmetric: bool = True) -> MarkedBody:
    """Scale the body model to a person.

    Parameters
    ----------
    subject : mass in kg, stature in m, sex, and standing markers in m (x forward, y left, z up),
        measured lengths or lengths by tape measure.
    symmetric : both sides are the mean of right and left; otherwise each arm and leg is its own, as
        it always is of a `subject` with a prosthesis, or with masses that differ between the sides.

    Returns
    -------
    MarkedBody
        Its mass is exactly the subject's. It has `markers` where the lengths are from those of a
        standing trial.

    Raises
    ------
    ScalingError
        The markers cannot be used, or the body that they give is not plausible.

    References
    ----------
    De Leva (1996), J. Biomech. 29:1223, table 4: masses, centres and inertias of the segments.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> body = gv.scale(subject)
    >>> abs(body.model.mass - subject.mass_kg) < 1e-9
    True
    >>> body.overview().columns.tolist()
    ['segment', 'length_m', 'mass_kg', 'factor']
    """
    expect("subject", subject, Subject, "what load_subject(5) returns")
    expect("symmetric", symmetric, bool, "True or False")
    found = scale_subject(subject, symmetric=symmetric)
    if not subject.markers or subject.measurements:
        return MarkedBody(found.model, found.table)
    try:
        marker_set = recognise(subject.markers).name
    except RecordError:
        return MarkedBody(found.model, found.table)
    return MarkedBody(found.model, found.table, marker_set, subject.markers)
