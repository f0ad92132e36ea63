"""Which code made a result, and when: shown beside versions and hashes on every page."""

import os
import re
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Final

from gaitval._internal.io import file_gate
from gaitval.errors import ArtefactError

INSTALLED: Final = "installed package"
"""Given in place of the commit where gaitval is not in a checkout of its own."""
UNREADABLE: Final = "checkout, its commit cannot be read"
BUILD_DATE: Final = "SOURCE_DATE_EPOCH"
"""Seconds since 1970 that a build gives as its date, so that it can be repeated byte for byte."""
_ROOT: Final = Path(__file__).resolve().parents[3]
_COMMIT: Final = re.compile(r"[0-9a-f]{40}|[0-9a-f]{64}")


def now() -> str:
    """The present minute as `2026-11-23 02:14 UTC`; that of `SOURCE_DATE_EPOCH` where it is set."""
    given = os.environ.get(BUILD_DATE)
    with suppress(ValueError, OverflowError, OSError):
        if given is not None:
            return _minute(datetime.fromtimestamp(int(given), UTC))
    return _minute(datetime.now(UTC))


def _minute(when: datetime) -> str:
    return f"{when:%Y-%m-%d %H:%M} UTC"


def minute_of(stamp: str) -> str:
    """`stamp`, an ISO 8601 time with its zone, in the form of `now`; empty for anything else."""
    with suppress(ValueError):
        return _minute(datetime.fromisoformat(stamp).astimezone(UTC))
    return ""


@cache
def source_commit(root: Path = _ROOT) -> str:
    """The git commit that the checkout of the running code stands at; else `INSTALLED`. What was
    changed in the checkout since is not known: only git could tell, which runs programs that a
    repository's settings name.

    `root` holds the package `gaitval`. It counts as a checkout only if git's own files are in it: a
    virtual environment inside another repository is none.
    """
    git = root / ".git"
    if not git.exists():
        return INSTALLED
    try:
        return _head(git)
    except (ArtefactError, UnicodeDecodeError, LookupError):
        return UNREADABLE


def _head(git: Path) -> str:
    """The commit of a folder `.git`, or of the file of this name that a second worktree has. Raises
    LookupError without one.
    """
    if git.is_file():
        git = git.parent / _read(git).removeprefix("gitdir: ").strip()
    branch = _read(git / "HEAD").strip().removeprefix("ref: ")
    shared = git / "commondir"
    common = git / _read(shared).strip() if shared.is_file() else git
    found = [branch]  # which is the commit itself where no branch is checked out
    found += [_read(each).strip() for each in (git / branch, common / branch) if each.is_file()]
    packed = common / "packed-refs"
    if packed.is_file():
        rows = (line.partition(" ") for line in _read(packed).splitlines())
        found += [commit for commit, _, name in rows if name == branch]
    commits = [each for each in found if _COMMIT.fullmatch(each)]
    if not commits:
        raise LookupError(f"{git}: names no commit.")
    return commits[0]


def _read(path: Path) -> str:
    return file_gate.read_text(path, ArtefactError, largest=file_gate.SIZES.written)
