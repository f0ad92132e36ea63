"""The main job, and its report, from Python."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.artefacts import read_json, write_json
from gaitval.configuration import load_configuration
from gaitval.datasets import subject as stored
from gaitval.errors import ArtefactError
from gaitval.folder_lock import held
from gaitval.interface.result import Result, of_kind, sourced_frame
from gaitval.interface.subjects import FORCE, MOMENT, Subject, load_subject
from gaitval.metrics.origin import is_recorded_at_all
from gaitval.metrics.record_results import RecordedCurves
from gaitval.metrics.results import MeanCurve, MeanCurves, Metrics, metrics_from
from gaitval.metrics.verdicts import sentence
from gaitval.reporting import report
from gaitval.study.run import run_one, run_subject
from gaitval.study.stage import RECORDS, Observer, open_run

METRICS = "metrics.json"
KINDS = (("angles", ""), ("moments", MOMENT), ("forces", FORCE))
REPORT = ("report.html", "report.pdf")


@dataclass(frozen=True, repr=False)
class Study(Result):
    """The validation of a subject's walks against the record.

    Attributes
    ----------
    folder : that it is of: a run folder, or a stored baseline.
    metrics : what `metrics.json` holds.
    """

    folder: Path
    metrics: Metrics

    def title(self) -> str:
        """Whose, and how many limits are met, or that nothing was recorded to judge by."""
        counts, name = self.metrics.summary, self.metrics.subject.identifier
        rows = counts.accepted + counts.refused
        if not is_recorded_at_all(self.metrics.as_dict()):
            return f"Study of {name}: {sentence(self.metrics.as_dict())}"
        return f"Study of {name}: {counts.accepted} of {rows} limits met"

    def summary(self) -> pd.DataFrame:
        """Each limit that decides the verdict, and how many of its measures meet it."""
        met: dict[tuple[str, str, str], list[bool]] = {}
        for row in self.metrics.tolerances:
            if row.role == "acceptance":
                limit = f"{row.limit.replace('_', ' ')} {row.tolerance:g}"
                met.setdefault((row.title, limit, row.unit), []).append(row.passed)
        return pd.DataFrame(
            [(*limit, f"{sum(passed)} of {len(passed)}") for limit, passed in met.items()],
            columns=["quantity", "limit", "unit", "met"],
        )

    def to_frame(self) -> pd.DataFrame:
        """Mean curves of the walk and of the record at 0, 1, … 100 % of each side's gait cycle:
        joint angles (deg), joint moments (Nm/kg), ground reaction (% of body weight). A column
        `source` says whose each row is.
        """
        name, walks = self.metrics.subject.identifier, self.metrics.walks
        walk = walks.identified if self.metrics.final == "identified" else walks.nominal
        assert walk is not None
        sources = {
            f"walk of {name}": self._named(walk.curves),
            self._other_side(): self._named(self.metrics.record.curves),
        }
        return sourced_frame(sources)

    def _other_side(self) -> str:
        """What the walk's curves stand beside."""
        name = self.metrics.subject.identifier
        recorded = is_recorded_at_all(self.metrics.as_dict())
        return f"the record of {name}" if recorded else f"the prediction for {name}"

    def _named(self, curves: RecordedCurves | MeanCurves) -> Iterator[tuple[str, str, Array]]:
        for kind, word in KINDS:
            unit = getattr(self.metrics.units, kind)
            for name, curve in getattr(curves, kind).items():
                values = curve.mean if isinstance(curve, MeanCurve) else curve
                shown = np.full(101, np.nan) if values is None else np.array(values, dtype=float)
                yield of_kind(name, word), unit, shown

    def save(self, path: str | Path) -> None:
        """Write `metrics.json` into a folder, whole or not at all."""
        write_json(Path(path) / METRICS, self.metrics.as_dict())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a finished run folder, a baseline, or what `save` wrote. Raises ArtefactError."""
        file = Path(path) / METRICS
        return cls(Path(path), metrics_from(read_json(file), str(file)))


def run_study(
    subject: stored.Subject | str | int | Path,
    *,
    out: str | Path | None = None,
    config: str | Path | None = None,
    settings: Sequence[str] = (),
    scratch: bool = False,
    force: bool = False,
    observer: Observer | None = None,
) -> Study:
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
    Study
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

    >>> from gaitval.interface.studies import Study
    >>> study = Study.load(gv.load_policy(5).folder)
    >>> study.metrics.summary.refused
    0
    >>> study.to_frame().columns.tolist()
    ['side', 'quantity', 'percent', 'value', 'unit', 'source']
    """
    person = subject if isinstance(subject, stored.Subject) else load_subject(subject)
    folder = Path("reports") / person.identifier if out is None else Path(out)
    configuration = load_configuration(config, settings=settings)
    with open_run(person, configuration, folder, observer or Observer()) as run:
        run_subject(run, scratch=scratch, force=force)
    return Study.load(folder)


def write_report(
    folder: str | Path,
    *,
    force: bool = False,
    language: str | None = None,
    paper: str | None = None,
) -> tuple[Path, Path]:
    """Write the report of a run, as `gaitval report` does: `report.html` and `report.pdf`.

    A run folder must be up to date, and its report is written only where something has changed. A
    stored baseline gets the report of what it holds; what is missing says so.

    Parameters
    ----------
    folder : a run folder, or a copy of a baseline.
    force : write the report though it is up to date.
    language : of the pages, such as "de"; citations stay English. None: as the run was asked for,
        "en" if it was not.
    paper : sheets of the PDF, "a4" or "letter". None: likewise.

    Returns
    -------
    tuple
        The paths of both files. Units stand beside each figure: deg, Nm/kg, % of body weight.

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
    where = Path(folder)
    if not (where / METRICS).is_file():
        raise ArtefactError(
            f"{where}: no {METRICS}, so there is nothing to report. Give a finished run folder, or "
            "run `gaitval subject` or run_study."
        )
    asked = {"language": language, "paper": paper}
    settings = [f"report.{key}={value}" for key, value in asked.items() if value is not None]
    if (where / RECORDS).is_file():
        subject = Subject.load(where / "subject.toml")
        configuration = load_configuration(where / "configuration.toml", settings=settings)
        with open_run(subject, configuration, where, Observer()) as run:
            run_one(run, "report", force=force)
    else:
        with held(where):
            report.write_report(where, settings)
    page, document = (where / name for name in REPORT)
    return page, document
