"""Markers of other formats than C3D: TRC, and what wings read."""

from pathlib import Path

from gaitval import wings
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording


def read_other(path: Path) -> Recording:
    """The markers in a file that is not C3D, as its reader gives them. Raises RecordError, as that
    does, and if there is none for the ending of `path`.
    """
    kind = path.suffix.lower()
    if kind == ".trc":
        from gaitval.mocap.trc import read_trc

        return read_trc(path)
    if (reader := wings.of_ending(wings.RECORDINGS, path)) is not None:
        found: Recording = reader(path)
        return found
    raise RecordError(
        f"{path}: markers are read from .c3d, .trc{further(wings.RECORDINGS)} and WBDS's "
        f"mkr.txt files, not from {kind or 'a file without an ending'}. Export the trial as "
        "C3D."
    )


def further(group: str) -> str:
    """The endings that wings of a `group` read, for a message."""
    return "".join(f", .{name}" for name in wings.names(group) if name != "txt")
