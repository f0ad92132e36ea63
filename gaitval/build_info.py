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
        commit = git(root, "rev-parse", "HEAD")
        changed = git(root, "status", "--porcelain", "--ignore-submodules=all", "--", "gaitval")
    except (OSError, subprocess.SubprocessError):
        return UNREADABLE
    return commit + ("+" if changed else "")


def git(folder: Path | None, *arguments: str) -> str:
    """What git prints of the repository `folder`, by default that of the current folder, whose
    settings run no programs. Raises OSError or subprocess.SubprocessError if it is missing or
    fails.
    """
    # The settings of a repository, which may have come out of an archive, can name programs: one
    # that watches files, filters by a name of their own, hooks, and those that fetch what is
    # missing.
    place = [] if folder is None else ["-C", str(folder)]
    drivers = _run(
        ["git", *place, "config", "--name-only", "-z", "--get-regexp", r"^filter\..*"], (0, 1)
    )
    none = {"core.fsmonitor": "false", "core.hooksPath": os.devnull}
    for each in filter(None, drivers.split("\0")):
        none[each] = "false" if each.endswith(".required") else ""
    settings = [word for name, value in none.items() for word in ("-c", f"{name}={value}")]
    return _run(["git", "--no-optional-locks", *place, *settings, *arguments], (0,)).strip()


def _run(command: list[str], codes: tuple[int, ...]) -> str:
    own = {**os.environ, "GIT_ALLOW_PROTOCOL": "none", "GIT_NO_LAZY_FETCH": "1", "GIT_PAGER": "cat"}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=_WAIT, env=own
    )
    if done.returncode not in codes:
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)
    return done.stdout
