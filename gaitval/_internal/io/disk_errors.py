"""Why the operating system did not write or read a file; loaded when it has not."""

import errno
import os
from pathlib import Path

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_TOO_LONG = (errno.ENAMETOOLONG,)
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)
FAILED = (errno.EIO, getattr(errno, "ESTALE", errno.EIO))


def is_of_another(error: Exception, path: Path) -> bool:
    """Whether an `error` names a file that is neither in the folder of `path` nor above it."""
    name = getattr(error, "filename", None)
    if not isinstance(name, str | os.PathLike):
        return False
    # a temporary file is named from the root, whatever the path of the one that it replaces
    named, path = Path(os.path.abspath(name)), Path(os.path.abspath(path))
    return named.parent != path.parent and named not in (path, *path.parents)


def why_unwritable(error: Exception) -> str | None:
    """Why the operating system refused to write a file, and how to fix it, as words for the middle
    of a message; None if the `error` is not about a disk or permissions.
    """
    # Libraries in other languages (safetensors, in Rust) give the system's error only as text.
    number = error.errno if isinstance(error, OSError) else None
    for kinds, message in (
        (_FULL, "there is no space left for it. Free some space"),
        (_TOO_LONG, "its name is too long. Give a shorter one"),
        (_NOT_ALLOWED, "its folder may not be written to. Change the permissions"),
        (FAILED, "its disk or network share reports an error. Check that it is there and sound"),
    ):
        if number in kinds or any(f"(os error {kind})" in str(error) for kind in kinds):
            return message
    return None
