"""Which code made a result, and when: shown beside versions and hashes on every page."""

import os
import subprocess
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Final

INSTALLED: Final = "installed package"
"""Given in place of the commit where gaitval is not in a checkout of its own."""
UNREADABLE: Final = "checkout, its commit cannot be read"
BUILD_DATE: Final = "SOURCE_DATE_EPOCH"
"""Seconds since 1970 that a build gives as its date, so that it can be repeated byte for byte."""
_ROOT: Final = Path(__file__).resolve().parent.parent
_WAIT: Final = 10.0
"""s, for git."""


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
    """The git commit of the running code, with `+` where the package differs from it; else
    `INSTALLED`.

    `root` holds the package `gaitval`. It counts as a checkout only if git's own files are in it: a
    virtual environment inside another repository is none.
    """
    if not (root / ".git").exists():
        return INSTALLED
    try:
        commit = _git(root, "rev-parse", "HEAD")
        changed = _git(root, "status", "--porcelain", "--", "gaitval")
    except (OSError, subprocess.SubprocessError):
        return UNREADABLE
    return commit + ("+" if changed else "")


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(root), *arguments],
        capture_output=True,
        text=True,
        check=True,
        timeout=_WAIT,
    )
    return done.stdout.strip()
