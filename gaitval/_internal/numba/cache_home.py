"""Where this machine keeps what is computed once for all runs: a folder that is the user's own.

Compiled code is run, so whoever can put a file there runs programs as the user. Where the folder is
says the environment alone: NUMBA_CACHE_DIR for compiled code, XDG_CACHE_HOME, or the home folder;
never a file, and never a path that begins in the current folder.
"""

import os
import stat
from pathlib import Path

from gaitval.errors import ConfigurationError

_LINKS = 40
"""Links that are followed on the way to a folder before it is refused, as Linux does."""
_WAY_OUT = "Set XDG_CACHE_HOME to a folder that only you can write to, such as"


def cache_home() -> Path:
    """The folder for caches: `XDG_CACHE_HOME`, else `.cache` in the home folder. A relative path
    does not count. Raises ConfigurationError if there is none that can be written to, as for a user
    without a home folder in a container.
    """
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        base = given if given.is_absolute() else Path.home() / ".cache"
    except RuntimeError:  # neither HOME nor an entry for the user
        base = Path("/nonexistent")
    if not base.is_absolute():  # HOME is relative
        base = Path("/nonexistent")
    there = next(folder for folder in (base, *base.parents) if folder.exists())
    if not os.access(there, os.W_OK):
        raise ConfigurationError(
            f"{base}: compiled code cannot be kept there, for the folder cannot be made or written "
            f'to. {_WAY_OUT} XDG_CACHE_HOME="$(mktemp -d)", or make one that stays.'
        )
    return base


def own_folder(base: Path) -> Path:
    """The folder `gaitval` in `base`, made if it is not there, and the user's own: nobody else can
    write to it, or put another one in its place. Raises ConfigurationError if it is not.
    """
    base = base.absolute()
    folder = base / "gaitval"
    try:
        for each in (*reversed(folder.parents), folder):
            if not each.exists():  # whatever the umask lets others do
                each.mkdir(mode=0o700, exist_ok=True)
        if hasattr(os, "getuid"):
            _check(folder)
    except OSError as error:
        _refuse(folder, error.strerror or str(error))
    return folder


def own_cache() -> Path:
    """`own_folder` of `cache_home`."""
    return own_folder(cache_home())


def _refuse(folder: Path, why: str) -> None:
    raise ConfigurationError(
        f"{folder}: compiled code is not kept there, and none is taken from there: {why}. Who can "
        f"write there can run programs as you. Make the folder yours alone (chown, chmod go-w), or "
        f'elsewhere: {_WAY_OUT} XDG_CACHE_HOME="$(mktemp -d)", or make one that stays.'
    )


def _check(folder: Path) -> None:
    """Refuse `folder` unless this user alone can write to it and replace what it is reached by."""
    real = _walked(folder)
    about = real.lstat()
    if about.st_uid != os.getuid():
        _refuse(folder, f"it belongs to user {about.st_uid}, and you are user {os.getuid()}")
    if not stat.S_ISDIR(about.st_mode):
        _refuse(folder, "it is no folder")
    if about.st_mode & 0o077:
        # One that an earlier version made. What others may have put there lacks the keyed hash.
        real.chmod(0o700)


def _walked(folder: Path) -> Path:
    """`folder` without links, if nobody else can replace a part of its path, links included."""
    left = list(reversed(folder.parts[1:]))
    at, links = Path(folder.anchor), 0
    superuser = {0, os.getuid(), at.lstat().st_uid}  # who owns the root can replace everything
    while True:
        about = at.lstat()
        if about.st_uid not in superuser:
            _refuse(folder, f"{at} belongs to user {about.st_uid}, and you are user {os.getuid()}")
        if stat.S_ISLNK(about.st_mode):
            links += 1
            if links > _LINKS:
                _refuse(folder, f"{at} is a link that leads to itself")
            target = at.readlink()
            at = Path(target.anchor) if target.is_absolute() else at.parent
            left += reversed(target.parts[1:] if target.is_absolute() else target.parts)
        elif left and _open_to_others(about):
            _refuse(folder, f"others can write to {at} (mode {stat.S_IMODE(about.st_mode):o})")
        if not left:
            return at
        name = left.pop()
        at = at.parent if name == ".." else at / name


def _open_to_others(about: os.stat_result) -> bool:
    """Whether other users can replace what this user has in a folder."""
    if about.st_mode & stat.S_ISVTX:  # as of the shared folder of temporary files: owners alone
        return False
    if about.st_mode & stat.S_IWOTH:
        return True
    return bool(about.st_mode & stat.S_IWGRP) and not _alone_in(about.st_gid)


def _alone_in(group: int) -> bool:
    """Whether `group` is the private one of this user, as most systems make one for each user."""
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return (
        user.pw_gid == group and found.gr_name == user.pw_name and {*found.gr_mem} <= {user.pw_name}
    )
