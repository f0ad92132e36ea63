"""Two sessions of one person, and one person against healthy adults, from Python."""

from pathlib import Path

import numpy as np

from gaitval.apps.changes.change import Change, change_between
from gaitval.apps.changes.visits import read_visit
from gaitval.errors import RecordError
from gaitval.interface.arguments import as_path, expect
from gaitval.metrics.single_case import CaseResult, compare_with_group
from gaitval.session.importing.stored import Session
from gaitval.subjects.subject import Subject


def change(
    before: str | Path, after: str | Path, *, walks: bool = False, same_person: bool = False
) -> Change:
    """What changed between two sessions of one person, as `gaitval change` says it.

    Parameters
    ----------
    before, after : folders of imports, or of finished studies, whose records are compared.
    walks : of studies, their walks instead.
    same_person : take on trust that it is one person although stature, mass or name differ.

    Returns
    -------
    Change
        `findings()` has the curves and where they changed, the largest first; `curves` all curves
        over 0 to 100 % of each side's cycle: angles in deg, moments in Nm/kg, ground reaction in %
        of body weight.

    Raises
    ------
    ArtefactError
        A folder holds neither an import nor a study.
    ConfigurationError
        Two people, two conventions, or no curve that both have.

    References
    ----------
    Nichols and Holmes (2002), Hum. Brain Mapp. 15:1: the test. Baker et al. (2009), Gait Posture
    30:265: the score.

    Examples
    --------
    >>> import gaitval as gv
    >>> found = gv.change("reports/before", "reports/after")  # doctest: +SKIP
    >>> [(curve.name, where.difference) for curve, where in found.findings()]  # doctest: +SKIP
    [('angles/knee_angle_l', 12.3)]

    What is no session is refused:

    >>> gv.change("nowhere", "nowhere")
    Traceback (most recent call last):
    gaitval.errors.ArtefactError: nowhere: neither recording/import.json of an import nor
    metrics.json of a study is in it, so there is no session to compare. Give the folder that
    `gaitval import --out` or `gaitval subject` wrote.
    """
    folders = (
        as_path(name, folder, "the folder of an import or a study")
        for name, folder in (("before", before), ("after", after))
    )
    return change_between(
        *(read_visit(each, walk=walks) for each in folders), same_person=same_person
    )


def against_healthy(person: Session | Subject) -> CaseResult:
    """One person's joint angles against 42 healthy adults, with one threshold for all of them.

    Parameters
    ----------
    person : a session of `import_session`, or a subject, whose record it is.

    Returns
    -------
    CaseResult
        Modified t (101,) of each angle and side; where it is above the threshold that 1 in 21
        healthy adults reaches anywhere, in any of the curves; and the share of people who are as
        far out.

    Raises
    ------
    RecordError
        No angle of the nine was recorded.

    References
    ----------
    Crawford and Howell (1998), Clin. Neuropsychol. 12:482. Fukuchi et al. (2018), PeerJ 6:e4640:
    the adults, at their own speed over ground.

    Examples
    --------
    >>> import gaitval as gv
    >>> found = gv.against_healthy(gv.load_subject(1))
    >>> sorted(found.regions), found.people
    ([], 42)
    """
    expect("person", person, (Session, Subject), "what import_session or load_subject returns")
    if isinstance(person, Session):
        angles = {
            name: np.degrees(np.asarray(person.curves[f"angle_{name}_mean"], dtype=float))
            for name in (
                column.removeprefix("angle_").removesuffix("_mean")
                for column in person.curves.columns
                if column.startswith("angle_") and column.endswith("_mean")
            )
        }
    else:
        phase = np.linspace(0.0, 1.0, 101)
        curves = person.gait.angles_of_both().items()
        angles = {name: np.degrees(angle(phase)) for name, angle in curves}
    found = compare_with_group(angles)
    if found is None:
        raise RecordError(
            f"{', '.join(sorted(angles)) or 'no angle'} was recorded, none of the nine that the "
            "healthy adults have (gaitval.gait.healthy_controls.PROFILE_ANGLES), so nothing can be "
            "compared. Record hips, knees, ankles or the pelvis."
        )
    return found
