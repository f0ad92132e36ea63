"""What an import that was refused found before: a page, and the files that were finished."""

from pathlib import Path
from typing import Final

from gaitval.configuration import ReportSettings
from gaitval.errors import GaitvalError, NoCycleError
from gaitval.reporting.page import write_page
from gaitval.session.importing.files import FOLDER, RECORD, REFUSED, SUBJECT
from gaitval.session.importing.write import (
    cycle_table,
    refusal_files,
    write_body,
    write_table,
    writing,
)
from gaitval.session.opensim.of_import import write_trial
from gaitval.session.request import Request
from gaitval.session.session import ImportProgress

EARLIER: Final = f"{SUBJECT}.before"
"""The subject of an earlier import into the folder of one that was refused."""


def write_refusal(
    folder: Path,
    request: Request,
    progress: ImportProgress,
    error: GaitvalError,
    settings: ReportSettings | None = None,
) -> Path:
    """Write what was found before an error into `folder`; returns the page.

    The subject of an earlier import is not that of these files: it is kept as `EARLIER`, where no
    command takes it for this one's. The page shows `request`, `progress` and `error`; `settings`
    give the paper, A4 by default.
    Raises ArtefactError if the folder cannot be written to.
    """
    target = Path(folder) / FOLDER
    with writing(folder):
        target.mkdir(parents=True, exist_ok=True)
        if (Path(folder) / SUBJECT).exists():
            (Path(folder) / SUBJECT).replace(Path(folder) / EARLIER)
        (target / RECORD).unlink(missing_ok=True)
        written = _finished(target, progress)
        context = {
            "request": request,
            "error": str(error),
            "trial_only": isinstance(error, NoCycleError) and bool(progress.trials),
            "ways_on": error.goes_on,
            "decisions": progress.decisions,
            "files": [path.name for path in written],
        }
        write_page(target, REFUSED, "refused.html.j2", context, settings)
    return refusal_files(target)[0]


def _finished(target: Path, progress: ImportProgress) -> list[Path]:
    written: list[Path] = []
    if progress.body is not None and progress.session is not None:
        written += write_body(target, progress.body, progress.session.marker_set)
    for number, walk in enumerate(progress.trials, start=1):
        written += write_trial(target, number, walk)
    if progress.trials:
        written.append(write_table(target / "cycles.csv", cycle_table(progress.trials)))
    return written
