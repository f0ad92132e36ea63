"""Subjects from Python."""

from pathlib import Path

from gaitval.subjects import subject_file
from gaitval.subjects.subject import Subject


def load_subject(name_or_path: str | int | Path) -> Subject:
    """A built-in subject, or one of a subject file.

    Parameters
    ----------
    name_or_path : 5, "5", "S05", the dataset's name "WBDS14", or the path of a .toml file.

    Returns
    -------
    Subject
        Mass in kg, lengths in m, speed in m/s; standing markers in m (x forward, y left, z up);
        the mean gait cycle of each side.

    Raises
    ------
    SubjectError
        There is no such subject, or the file has problems (all are listed).

    References
    ----------
    Fukuchi, Fukuchi, Duarte (2018), PeerJ 6:e4640: the built-in subjects are computed from it.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> subject.identifier
    'S05'
    >>> list(subject.to_frame().columns)
    ['side', 'quantity', 'percent', 'value', 'unit']
    """
    return subject_file.load_subject(name_or_path)
