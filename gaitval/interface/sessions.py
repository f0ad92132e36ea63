"""The import of a laboratory's session from Python."""

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gaitval.configuration import load_configuration
from gaitval.interface.arguments import as_path
from gaitval.session.importing.importing import import_files
from gaitval.session.importing.stored import Session
from gaitval.session.request import ImportOptions, Notify, checked, silent


def import_session(
    static: str | Path | None,
    trials: str | Path | Sequence[str | Path],
    *,
    out: str | Path,
    config: str | Path | None = None,
    settings: Sequence[str] = (),
    notify: Notify = silent,
    **options: Any,
) -> Session:
    """Turn a laboratory's recordings into a subject, as `gaitval import` does.

    It finds the axes and the marker set, cleans the markers, fits the body to the standing and the
    walking trials, and works out joint angles, joint moments and the mean gait cycle. It takes
    seconds for a walk over plates, a minute for long trials.

    Parameters
    ----------
    static : the standing trial: C3D, TRC; None puts a standing pose together from the walk.
    trials : the walking trials: C3D, TRC, WBDS mkr.txt; their cycles are pooled.
    out : folder for the files; the subject is named after it.
    config : TOML file of settings, or the name of a built-in one, as for `--config`.
    settings : "section.key=value", as for `--set`.
    notify : called with each decision: the step, and a sentence.
    options : any other field of `ImportOptions`, which says what each is: `sex`, "F" or "M", is
        needed; mass (kg) and height (m), if no C3D file knows them.

    Returns
    -------
    Session
        With its `subject`, for `run_study`, and its `body`, for `inverse_kinematics`. Lengths in m,
        masses in kg; axes x forward, y left, z up.

    Raises
    ------
    ConfigurationError
        An option is unknown, missing or of the wrong kind.
    SubjectError
        A mass, a stature or a sex that cannot be.
    RecordError, ScalingError
        The files cannot be used; the message says which, why, and how to fix it.
    ArtefactError
        The folder cannot be written to.

    References
    ----------
    Hicks et al. (2015), J. Biomech. Eng. 137:020905: how marker errors and residuals are judged.

    Examples
    --------
    >>> import gaitval as gv
    >>> session = gv.import_session(
    ...     "stand.c3d", "walk.c3d", mass=74.3, height=1.725, sex="M", out="mine"
    ... )  # doctest: +SKIP
    >>> study = gv.run_study(session.subject, out="mine/run")  # doctest: +SKIP

    What cannot be true is refused before a file is read:

    >>> gv.import_session("stand.c3d", "walk.c3d", mass=74.3, height=172.5, sex="M", out="mine")
    Traceback (most recent call last):
    gaitval.errors.SubjectError: --height 172.5: this looks like centimetres; give metres: --height
    1.725.
    """
    import_files(
        checked(ImportOptions, {"static": static, "trials": trials, **options}),
        as_path("out", out, "the path of a folder to write"),
        configuration=load_configuration(config, settings=settings),
        notify=notify,
    )
    return Session.load(out)


_OWN = inspect.signature(import_session).parameters
_OPTIONS = inspect.signature(ImportOptions).parameters
vars(import_session)["__signature__"] = inspect.Signature(
    [
        *(each for each in _OWN.values() if each.kind != each.VAR_KEYWORD),
        *(_OPTIONS[name].replace(annotation=Any) for name in _OPTIONS if name not in _OWN),
    ]
)  # for `help` and for completion, which then show every option
