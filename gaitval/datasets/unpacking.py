"""Unpack ZIP archives, whole or not at all."""

import errno
import shutil
import stat
import tempfile
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final

from gaitval import file_gate
from gaitval.disk_errors import why_unwritable
from gaitval.errors import ArchiveError

DISK_MARGIN: Final = 200_000_000
"""Bytes that a download leaves free on the disk."""
UNPACKED_LIMIT: Final = 20_000_000_000
"""Bytes; an archive that contains more is refused. The largest known one contains about 2 GB."""
MEMBERS_LIMIT: Final = 100_000
"""Files; an archive that contains more is refused. The largest known one contains about 10 000."""


def check_disk(folder: Path, needed: int) -> None:
    """Raise ArchiveError rather than fill the disk of `folder` with `needed` bytes."""
    free = shutil.disk_usage(folder).free
    if free < needed + DISK_MARGIN:
        raise ArchiveError(
            f"{folder}: {free / 1e9:.2f} GB are free on this disk, but "
            f"{(needed + DISK_MARGIN) / 1e9:.2f} GB are needed. Free some space or name another "
            "folder."
        )


def unpack(archive: Path, folder: Path) -> None:
    """Unpack the ZIP file `archive` into `folder`, whole or not at all; an old `folder` is
    replaced.

    Raises ArchiveError if it is not a ZIP archive, or a damaged one; a member lies outside the
    folder (absolute path or ".."), or is a link; more than `UNPACKED_LIMIT` bytes or
    `MEMBERS_LIMIT` members.
    """
    try:
        file_gate.passed(archive, ArchiveError, largest=file_gate.BINARY)
        with zipfile.ZipFile(archive) as stored:
            members = stored.infolist()
            _check_members(archive, members)
            check_disk(archive.parent, sum(member.file_size for member in members))
            with tempfile.TemporaryDirectory(
                dir=archive.parent, prefix=f".{folder.name}."
            ) as temporary:
                stored.extractall(Path(temporary) / "new")
                if folder.exists():
                    folder.replace(Path(temporary) / "old")
                (Path(temporary) / "new").replace(folder)
    except (
        *(zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError),
        OSError,  # a place before the beginning, or a name that no system takes
    ) as error:
        too_long = isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG
        if why_unwritable(error) is not None and not too_long:  # a member's name is the archive's
            raise
        raise ArchiveError(
            f"{archive}: cannot be read as a ZIP archive ({error}). Delete it and fetch it again."
        ) from None


def _check_members(archive: Path, members: list[zipfile.ZipInfo]) -> None:
    size = sum(member.file_size for member in members)
    if len(members) > MEMBERS_LIMIT or size > UNPACKED_LIMIT:
        raise ArchiveError(
            f"{archive}: contains {len(members)} members of {size} bytes in total; at most "
            f"{MEMBERS_LIMIT} members and {UNPACKED_LIMIT} bytes are allowed. Nothing was "
            "unpacked."
        )
    for member in members:
        # zipfile itself would silently turn an unsafe name into another one
        name = member.filename.replace("\\", "/")
        path = PurePosixPath(name)
        outside = path.is_absolute() or ".." in path.parts or ":" in name.split("/", 1)[0]
        if outside or stat.S_ISLNK(member.external_attr >> 16):
            raise ArchiveError(
                f"{archive}: member {member.filename!r} would be written outside its folder or is "
                "a link. This is not the published archive; nothing was unpacked."
            )
