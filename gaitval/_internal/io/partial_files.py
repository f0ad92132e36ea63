"""What is still being written, and what killed processes have left of it."""

import atexit
import glob
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

PARTIAL: Final = ".partial-"
"""First letters of the name of a file that is still being written (`artefacts.replacing`), or of a
temporary folder (`artefacts.scratch`)."""
OF_SOCKETS: Final = "gaitval-workers-"
"""Of the folder, among the system's temporary files, of the socket of the server of workers."""
_LEVELS: Final = 3
"""Levels of folders that gaitval makes below a run folder."""


@contextmanager
def in_use(handle: int) -> Iterator[bool]:
    """Lock what is open as `handle` until the block or the process ends, and close it; whether it
    could be locked. It cannot while another has it, and never on Windows and some file systems.
    """
    locked = True
    try:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        locked = False
        os.close(handle)  # now, because Windows replaces no open file
    try:
        yield locked
    finally:
        if locked:
            os.close(handle)


def remove_abandoned(folder: Path, prefix: str, suffix: str) -> None:
    """Remove what `tempfile` has named by `prefix` and `suffix` in `folder`, is this user's, and
    nobody has locked: whoever wrote it has been killed.
    """
    names = f"{glob.escape(prefix)}????????{glob.escape(suffix)}"
    for left in folder.glob(names) if os.name == "posix" else ():
        opened = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK
        with suppress(OSError), in_use(os.open(left, opened)) as locked:
            # what is of this second may not be locked yet; another user's is theirs to remove
            about = left.lstat()
            if locked and about.st_uid == os.getuid() and abs(time.time() - about.st_mtime) > 1.0:
                _remove(left)


@contextmanager
def own_folder(where: Path, prefix: str) -> Iterator[Path]:
    """A folder in `where` whose name begins with `prefix`, removed when the block ends. Such that
    killed processes have left, whose lock nobody holds, are removed first.
    """
    remove_abandoned(where, prefix, "")
    with (
        tempfile.TemporaryDirectory(dir=where, prefix=prefix) as name,
        # Windows opens no folder
        in_use(os.open(name if os.name == "posix" else os.devnull, os.O_RDONLY)),
    ):
        yield Path(name)


def remove_partial(folder: Path) -> None:
    """Remove whatever a killed process has left half written in the run `folder` and the folders
    below it. Call it with the folder locked, because another process may be writing.
    """
    for each in list(_below(folder)):
        if each.name.startswith(PARTIAL):
            _remove(Path(each.path))


def linked_folders(folder: Path) -> list[Path]:
    """The links to folders in the run `folder` and below it: what goes there lands elsewhere."""
    return [Path(each.path) for each in _below(folder) if each.is_symlink() and each.is_dir()]


def _below(folder: Path, levels: int = _LEVELS) -> Iterator[os.DirEntry[str]]:
    """What is in a run folder and the folders below it. No link is followed."""
    with os.scandir(folder) as entries:
        for each in sorted(entries, key=lambda entry: entry.name):
            yield each
            if levels and each.is_dir(follow_symlinks=False):
                with suppress(OSError):  # one that may not be read has nothing of ours
                    yield from _below(Path(each.path), levels - 1)


def _remove(left: Path) -> None:
    if left.is_dir() and not left.is_symlink():
        shutil.rmtree(left)
    else:
        left.unlink(missing_ok=True)


def hold(folder: str) -> None:
    """Lock `folder` until this process ends, so that no other takes it for abandoned."""
    with suppress(ImportError, OSError):
        import fcntl

        fcntl.flock(os.open(folder, os.O_RDONLY), fcntl.LOCK_EX | fcntl.LOCK_NB)


@atexit.register
def _remove_socket() -> None:
    """The folder of the socket of the server of workers: `multiprocessing` removes it in the parent
    alone, which may have been killed; the server ends after it, and both come here.
    """
    server = getattr(sys.modules.get("multiprocessing.forkserver"), "_forkserver", None)
    address = getattr(server, "_forkserver_address", None)
    if isinstance(address, str) and (folder := Path(address).parent).name.startswith(OF_SOCKETS):
        shutil.rmtree(folder, ignore_errors=True)
