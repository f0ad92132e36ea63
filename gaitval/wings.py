"""Optional parts of gaitval, its wings, which register themselves as entry points.

The core imports none of them. It asks for an entry point by its group and its name, so that a wing
is loaded only when a user asks for what it does. Wings of other distributions are found as well.
"""

from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Final

from gaitval.errors import ConfigurationError

COMMANDS: Final = "gaitval.commands"
"""Group of the commands: each an `gaitval.terminal.app.Added`, by the name of the command."""
PARTS: Final = "gaitval.parts"
"""Group of functions and modules that the core, or another wing, asks for by name."""
RECORDINGS: Final = "gaitval.recordings"
"""Group of readers of trials by the ending of a file: from its path to a `Recording`."""
FORCES: Final = "gaitval.forces"
"""Group of readers of forces by the ending of a file: from its path and the `Recording` whose they
are to the rate, the first time and the plates."""
DRAWN: Final = "gaitval.drawn"
"""Group of what the replay draws on the body, such as a device: from a run folder to shapes
{segment, kind, position, size, turned}, m in the segment's frame: kind "box" with three lengths,
"sphere" with a radius, "cylinder" (along z) with radius and length, all turned by a quaternion x,
y, z, w if there is one; or {segment, kind: "skin"}, the segment itself."""
SESSIONS: Final = "gaitval.sessions"
"""Group of readers of a program's folders, by its name: from a folder to each session in it, as the
file that describes it and tables as those of a session file; none for another program's."""


def names(group: str) -> list[str]:
    """The names that installed wings register in `group`, in alphabetical order."""
    return sorted(entry_points(group=group).names)


def of_ending(group: str, path: Path) -> Any:
    """What a wing registers in `group` for files that end as `path` does; None if none does."""
    name = path.suffix.lower().removeprefix(".")
    return _registered(group, name) if name in names(group) else None


def load(group: str, name: str) -> Any:
    """The object that a wing registers as `name` in `group`. Raises ConfigurationError if none does
    or it cannot be imported; the message says how to install it.
    """
    return _registered(group, name)


def _registered(group: str, name: str) -> Any:
    found: EntryPoint | None = next(iter(entry_points(group=group, name=name)), None)
    try:
        if found is not None:
            return found.load()
        why = "is not installed"
    except ImportError as error:
        from gaitval.missing_extras import raise_named

        raise_named(error)
        why = f"cannot be loaded ({error})"
    raise ConfigurationError(
        f"{name}: this optional part of gaitval {why}. Install it: python -m pip install "
        "'gaitval[all]', or, in a checkout, make setup."
    )
