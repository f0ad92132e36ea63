"""What other distributions add to gaitval, as entry points: readers of files, and commands."""

from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Final

from gaitval.errors import ConfigurationError

COMMANDS: Final = "gaitval.commands"
"""Group of commands: each a `gaitval.cli.terminal.app.Added`, by the name of the command."""
RECORDINGS: Final = "gaitval.recordings"
"""Group of readers of trials by the ending of a file: from its path to a `Recording`."""
FORCES: Final = "gaitval.forces"
"""Group of readers of forces by the ending of a file: from its path and the `Recording` whose they
are to the rate, the first time and the plates."""
SESSIONS: Final = "gaitval.sessions"
"""Group of readers of a program's folders, by its name: from a folder to each session in it, as the
file that describes it and tables as those of a session file; none for another program's."""


def names(group: str) -> list[str]:
    """The names that installed distributions register in `group`, in alphabetical order."""
    return sorted(entry_points(group=group).names)


def of_ending(group: str, path: Path) -> Any:
    """What is registered in `group` for files that end as `path` does; None if nothing is."""
    name = path.suffix.lower().removeprefix(".")
    return load(group, name) if name in names(group) else None


def load(group: str, name: str) -> Any:
    """The object that a distribution registers as `name` in `group`. Raises ConfigurationError,
    with the distribution, if none does or it cannot be imported.
    """
    found: EntryPoint | None = next(iter(entry_points(group=group, name=name)), None)
    if found is None:
        raise ConfigurationError(f"{name}: nothing that is installed registers it in {group}.")
    try:
        return found.load()
    except Exception as error:
        owner = found.dist.name if found.dist else "another distribution"
        raise ConfigurationError(
            f"{name} of {owner} ({found.value}) cannot be loaded: {type(error).__name__}: {error}. "
            f"Install {owner} again, or remove it: python -m pip uninstall {owner}."
        ) from error
