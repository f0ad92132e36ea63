"""Motion-capture trials from Python."""

from pathlib import Path

from gaitval.interface.arguments import as_path
from gaitval.mocap import reading
from gaitval.mocap.given_axes import parse_axes
from gaitval.mocap.recording import Recording


def read_recording(
    path: str | Path, *, forces: str | Path | None = None, axes: str | None = None
) -> Recording:
    """Read one trial: C3D, TRC, or a marker file of WBDS.

    Parameters
    ----------
    path : .c3d, .trc, or `…mkr.txt` of WBDS.
    forces : ground reaction of markers without: .mot, .sto, or `…grf.txt` of WBDS.
    axes : the laboratory's, as "forward=+x up=+y"; the trial is then turned into the project's
        (x forward, y left, z up). When not given it stays in the laboratory's.

    Returns
    -------
    Recording
        `markers` (T, M, 3) m, NaN where not seen; plates in N and Nm, (T, 3) each.

    Raises
    ------
    RecordError
        The file is of an unknown kind, damaged, in another unit, or does not fit `forces`.

    References
    ----------
    The C3D format, www.c3d.org; the axes follow REP-103 (ROS).

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import gaitval as gv
    >>> from gaitval.mocap.trc_writing import write_trc
    >>> from gaitval.mocap.recording import Recording
    >>> places = np.array([[0.1, -0.1, 0.9], [0.1, 0.1, 0.9], [0.0, -0.1, 0.0]])
    >>> names = ("R.ASIS", "L.ASIS", "R.Heel")
    >>> made = Recording("stand", "laboratory", names, np.tile(places, (10, 1, 1)), 100.0)
    >>> write_trc(Path("stand.trc"), made)
    >>> trial = gv.read_recording("stand.trc", axes="forward=+x up=+z")
    >>> trial.names
    ('R.ASIS', 'L.ASIS', 'R.Heel')
    >>> print(*trial.marker("R.ASIS")[0])
    0.1 -0.1 0.9
    """
    trial = as_path("path", path, 'the file of a trial, such as "walk.c3d"')
    beside = None if forces is None else as_path("forces", forces, "the file of its forces")
    found = reading.read_recording(trial, forces=beside)
    return found if axes is None else found.turned(parse_axes(axes).rotation)
