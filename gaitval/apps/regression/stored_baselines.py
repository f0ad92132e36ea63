"""Find a stored baseline by what a user names: a folder, a file in it, or a subject."""

from pathlib import Path
from typing import Final

import gaitval
from gaitval.errors import ArtefactError
from gaitval.subjects.subject_file import BUILTIN, builtin_name

METRICS: Final = "metrics.json"
_PACKAGE: Final = Path(gaitval.__file__).parent


def installed_baselines() -> dict[str, Path]:
    """The baselines that come with gaitval, by subject: the checkout's, else the package's."""
    found = {}
    for identifier in BUILTIN:
        for folder in (
            _PACKAGE.parent / "reports" / identifier / "baseline",
            _PACKAGE / "baselines" / identifier,
        ):
            if (folder / METRICS).is_file():
                found[identifier] = folder
                break
    return found


def find_baseline(wanted: str | Path, root: Path | None = None) -> Path:
    """The folder of a stored baseline. `wanted` is the folder, the `metrics.json` in it, a run
    folder that has one, or a built-in subject (`S05`, `5`, `WBDS14`): then the one below `root`
    that `gaitval baseline` wrote, else the one that comes with gaitval. A path is that path alone,
    relative to `root` (the current folder if None): where a project's own baseline is missing,
    nothing else takes its place. Raises ArtefactError if there is none; the message lists where it
    was looked for, and what exists.
    """
    base = Path() if root is None else root
    path = base / wanted
    looked = [path]
    if path.name == METRICS and path.is_file():
        return path.parent
    for folder in (path, path / "baseline"):
        # a folder with metrics.json may be a run, whose baseline is in it
        if (folder / METRICS).is_file() and not (folder / "baseline" / METRICS).is_file():
            return folder
    if path.is_dir():
        looked.append(path / "baseline")
    identifier = builtin_name(str(wanted))
    if identifier is not None:
        own = base / "reports" / identifier / "baseline"
        if (own / METRICS).is_file():
            return own
        installed = installed_baselines()
        if identifier in installed:
            return installed[identifier]
        looked += [own, _PACKAGE / "baselines" / identifier]
    raise ArtefactError(_none(wanted, list(dict.fromkeys(looked))))


def _none(wanted: str | Path, looked: list[Path]) -> str:
    installed = installed_baselines()
    names = ", ".join(installed) if installed else "none"
    where = f" in {next(iter(installed.values())).parent}" if installed else ""
    if installed and next(iter(installed.values())).name == "baseline":
        where = f" in {next(iter(installed.values())).parents[1]}"
    return (
        f"{wanted}: no stored baseline. Looked for {METRICS} in "
        f"{', '.join(str(folder) for folder in looked)}. `gaitval baseline SUBJECT` makes one of a "
        "finished run. Those that come with gaitval may be given by their subject, such as "
        f"--baseline S05: {names}{where}."
    )
