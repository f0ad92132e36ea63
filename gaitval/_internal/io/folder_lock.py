"""One process at a time in a folder, and what a killed one has left there."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import filelock

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import make_folder, write_text, writing
from gaitval._internal.io.partial_files import linked_folders, remove_partial
from gaitval.errors import ArtefactError


def check_links(folder: Path) -> None:
    """Refuse a `folder` to write to that has links to folders in it, before any work. The folder
    itself may be one, since the user has named it. Raises ArtefactError.
    """
    links = linked_folders(folder) if os.path.isdir(folder) else []
    if links:
        raise ArtefactError(
            f"{links[0]}: is a link to a folder. gaitval follows no link in a folder that it "
            "writes to, because files elsewhere would be replaced. Remove the link, or give "
            "another folder with --out."
        )


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock `folder` for this process, until the block or the process ends. It is made if it is not
    there, and what a killed process left half written is removed. Raises ArtefactError if another
    process works in it, it cannot be written to, or `check_links` refuses it.
    """
    make_folder(folder)
    # The process is named in a separate file, because Windows lets nobody read a locked file.
    lock, holder = filelock.FileLock(folder / ".lock"), folder / ".process"
    try:
        lock.acquire(blocking=False)
    except filelock.Timeout:
        known = holder.is_file() and file_gate.read_bytes(holder, ArtefactError, largest=100)
        process = f" (process {int(known)})" if known and known.isdigit() else ""
        raise ArtefactError(
            f"{folder}: another gaitval{process} is running in this folder. Wait for it to end, "
            "or give this run its own folder with --out."
        ) from None
    except OSError as error:
        # A full disk, a quota or a read-only system: `writing` turns these into its own message.
        with writing(folder / ".lock"):
            if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS):
                raise
        raise ArtefactError(
            f"{folder / '.lock'}: cannot be locked ({error.strerror}); it must be a plain file "
            "that you may write to. Delete it, or give another folder with --out."
        ) from None
    try:
        # Only now: before the lock is held, the partial files might be those of a running process.
        check_links(folder)
        remove_partial(folder)
        write_text(holder, str(os.getpid()))
        yield
    finally:
        # The holder's file goes first: once the lock is released, it may already be another's.
        holder.unlink(missing_ok=True)
        lock.release()
