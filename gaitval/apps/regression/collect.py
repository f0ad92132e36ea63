"""Find the finished walks in run folders, stored baselines, and folders of them."""

from collections.abc import Sequence
from pathlib import Path

from gaitval.apps.regression.baseline import check_complete
from gaitval.apps.regression.finished import check_finished, why_unfinished
from gaitval.apps.regression.seal import SEAL, check_parts
from gaitval.apps.regression.versions import StoredWalk, twice
from gaitval.errors import ArtefactError
from gaitval.metrics.results import read_metrics
from gaitval.study.inputs import METRICS
from gaitval.study.stage import RECORDS


def collect(paths: Sequence[Path]) -> list[StoredWalk]:
    """The walks at these `paths`, in their order, each once.

    A path is a run folder, a stored baseline, the `metrics.json` of one, or a folder of such
    folders (`reports`). Of a run folder with a baseline in it, the run counts, if it is finished.
    Raises ArtefactError if nothing is there, a run is not finished and has no baseline, metrics do
    not match the schema, or a baseline is not as it was sealed.
    """
    files = {file.resolve(): file for path in paths for file in _files(path)}
    return [_read(file) for file in files.values()]


def collect_versions(
    before: Sequence[Path], now: Sequence[StoredWalk]
) -> tuple[list[StoredWalk], Sequence[StoredWalk]]:
    """The walks `before` at some places, and those `now`, ready to be matched by subject. Raises
    ArtefactError as `collect`, and if a subject is there twice in one version, or none is in both.
    """
    then = collect(before)
    for walks, which in ((then, "--before"), (now, "RUN")):
        doubled = twice(walks)
        if doubled:
            where = ", ".join(str(walk.folder) for walk in walks if walk.subject == doubled[0])
            raise ArtefactError(
                f"{where}: all of subject {doubled[0]}, so it is not clear which of them to "
                f"compare. Give one of them with {which}."
            )
    if not {walk.subject for walk in then} & {walk.subject for walk in now}:
        raise ArtefactError(
            f"{', '.join(map(str, before))}: of {', '.join(walk.subject for walk in then)}, but "
            f"the runs are of {', '.join(walk.subject for walk in now)}: no subject is in both, so "
            "nothing can be compared. Give two versions of the same subjects."
        )
    return then, now


def _files(path: Path) -> list[Path]:
    if path.is_file():
        if _is_run(path.parent):
            check_finished(path.parent)
        return [path]
    own = _of_run(path)
    if own is not None:
        return [own]
    if not path.is_dir():
        raise ArtefactError(
            f"{path}: no such folder, so there is no walk to compare. Give run folders, stored "
            "baselines, or a folder that contains some."
        )
    found = [file for child in sorted(path.iterdir()) if (file := _of_run(child)) is not None]
    if not found:
        raise ArtefactError(
            f"{path}: neither it nor a folder in it has a {METRICS}, so there is no walk to "
            "compare. Give the folder of a finished run (`gaitval subject`) or of a stored "
            "baseline."
        )
    return found


def _of_run(folder: Path) -> Path | None:
    """The metrics of a baseline or a finished run, else those of the baseline in it."""
    own, stored = folder / METRICS, folder / "baseline" / METRICS
    if not own.is_file():
        return stored if stored.is_file() else None
    if not _is_run(folder):
        return own
    if stored.is_file() and why_unfinished(folder) is not None:
        return stored
    check_finished(folder)
    return own


def _is_run(folder: Path) -> bool:
    """Whether it is a run; else a baseline, or metrics that were copied alone."""
    return (folder / RECORDS).is_file()


def _read(file: Path) -> StoredWalk:
    margins = None
    if (file.parent / SEAL).exists():
        check_complete(file.parent)
        margins = check_parts(file.parent).margins
    return StoredWalk(folder=file.parent, metrics=read_metrics(file), margins=margins)
