"""The main job, and its report, from Python."""

import random
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from gaitval._internal.io.folder_lock import locked
from gaitval.apps.devices.of_subject import afterwards
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.interface.arguments import as_path
from gaitval.metrics.results import METRICS, Metrics, read_metrics
from gaitval.reporting import report
from gaitval.study.one_stage import run_one
from gaitval.study.run import run_subject
from gaitval.study.stage import RECORDS, Observer, open_run
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject

FOLDER = "the path of a run folder"

REPORT = ("report.html", "report-details.html", "report.pdf")


def run_study(
    subject: Subject | str | int | Path,
    *,
    out: str | Path | None = None,
    config: str | Path | None = None,
    settings: Sequence[str] = (),
    scratch: bool = False,
    force: bool = False,
    observer: Observer | None = None,
) -> Metrics:
    """Run the main job, as `gaitval subject` does: from the recorded gait to the report.

    Stages that are up to date are skipped, and an interrupted training resumes, so that the same
    call may be made again. Minutes from the general policy, more from nothing.

    Parameters
    ----------
    subject : of `load_subject` or `import_session`, or what `load_subject` takes.
    out : run folder; `reports/IDENTIFIER` when not given.
    config : TOML file of settings, or the name of a built-in one, as for `--config`.
    settings : "section.key=value", as for `--set`.
    scratch : train from nothing, and not from the general policy.
    force : run every stage, up to date or not.
    observer : hears what the stages do; silent when not given.

    Returns
    -------
    Metrics
        Errors, limits and mean curves (101 points; deg, Nm/kg, % of body weight) of the walk.

    Raises
    ------
    SubjectError
        There is no such subject.
    ConfigurationError
        There is no such setting, or a value is out of range.
    ArtefactError
        The folder cannot be written to, or another gaitval works in it.

    References
    ----------
    V. Kumar, Modelling Human Kinetics and Kinematics during Walking using Reinforcement Learning:
    algorithm 1.

    Examples
    --------
    >>> import gaitval as gv
    >>> study = gv.run_study(5, out="S05", settings=["seed=1"])  # doctest: +SKIP

    What a finished run, or a stored one, came to is read again from its folder:

    >>> from gaitval.metrics.results import read_metrics
    >>> study = read_metrics(gv.load_policy(5).folder)
    >>> study.summary.nearer, study.summary.curves  # nearer than any prediction without a model
    (8, 32)
    >>> study.to_frame().columns.tolist()
    ['side', 'quantity', 'percent', 'value', 'unit', 'source']
    """
    person = subject if isinstance(subject, Subject) else load_subject(subject)
    folder = Path("reports") / person.identifier if out is None else as_path("out", out, FOLDER)
    configuration = load_configuration(config, settings=settings)
    with open_run(person, configuration, folder, observer or Observer()) as run, own_random():
        run_subject(run, scratch=scratch, force=force, afterwards=afterwards(person))
    return read_metrics(folder)


@contextmanager
def own_random() -> Iterator[None]:
    """Within the block, random numbers may be seeded; after it the caller's go on as before."""
    torch = sys.modules.get("torch")  # one that is loaded within was nobody's before
    # stable-baselines3 seeds numpy's old generator
    states = random.getstate(), np.random.get_state(), torch and torch.get_rng_state()  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(states[0])
        np.random.set_state(states[1])  # noqa: NPY002
        if torch is not None:
            torch.set_rng_state(states[2])


def write_report(
    folder: str | Path,
    *,
    force: bool = False,
    paper: str | None = None,
) -> tuple[Path, Path]:
    """Write the report of a run, as `gaitval report` does: `report.html`, `report-details.html` and
    `report.pdf`.

    A run folder must be up to date, and its report is written only where something has changed. A
    stored baseline gets the report of what it holds; what is missing says so.

    Parameters
    ----------
    folder : a run folder, or a copy of a baseline.
    force : write the report though it is up to date.
    paper : sheets of the PDF, "a4" or "letter". None: as the run was asked for, "a4" if it was not.

    Returns
    -------
    tuple
        The paths of page and PDF; the details are beside them. Units stand beside each figure:
        deg, Nm/kg, % of body weight.

    Raises
    ------
    ArtefactError
        There is no run in the folder, or a stage before the report is not up to date.

    References
    ----------
    Each limit in the report cites its own source; all are in `gaitval/metrics/tolerances.toml`.

    Examples
    --------
    >>> import shutil
    >>> import gaitval as gv
    >>> folder = shutil.copytree(gv.load_policy(5).folder, "S05")
    >>> page, document = gv.write_report(folder)
    >>> page.name, document.name
    ('report.html', 'report.pdf')
    """
    where = as_path("folder", folder, FOLDER)
    if not (where / METRICS).is_file():
        raise ArtefactError(
            f"{where}: no {METRICS}, so there is nothing to report. Give a finished run folder, or "
            "run `gaitval subject` or run_study."
        )
    settings = [] if paper is None else [f"report.paper={paper}"]
    if (where / RECORDS).is_file():
        subject = load_subject(where / "subject.toml")
        configuration = load_configuration(where / "configuration.toml", settings=settings)
        with open_run(subject, configuration, where, Observer()) as run:
            run_one(run, "report", force=force)
    else:
        with locked(where):
            report.write_report(where, settings)
    page, _, document = (where / name for name in REPORT)
    return page, document
